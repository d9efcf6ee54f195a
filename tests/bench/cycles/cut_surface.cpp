// The surface of a filled solid, cut open across x through the middle, with the colors of its grid at the
// vertices: what a renderer needs whose surfaces cannot look into volumes.
//
//     bench_cut_surface FILLED.vdb OUT.obj
//
// Lines "v x y z r g b" (mesh units, scene-linear), the cut as squares of half a voxel.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>

#include "polestar/core/error.h"
#include "polestar/vdb/sampled_grids.h"

namespace polestar {
namespace {

struct ColoredMesh {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::size_t>> faces;
};

/// What lies beyond x = plane is left out, and triangles that reach across it end there.
void addSkin(const TriMesh& skin, double plane, ColoredMesh& mesh) {
  for (const Vec3& v : skin.vertices) mesh.vertices.emplace_back(std::min(v.x(), plane), v.y(), v.z());
  for (const Triangle& t : skin.triangles) {
    const auto beyond = [&](auto v) { return skin.vertices[v].x() >= plane; };
    if (beyond(t[0]) && beyond(t[1]) && beyond(t[2])) continue;
    mesh.faces.push_back(
        {static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]), static_cast<std::size_t>(t[2])});
  }
}

/// Squares across x = plane, wherever they touch the solid.
void addCut(const SampledGrid& density, const Box& box, double plane, ColoredMesh& mesh) {
  const double step = 0.5 * density.voxelSize();
  const auto across = static_cast<std::size_t>((box.max.y() - box.min.y()) / step) + 2,
             up = static_cast<std::size_t>((box.max.z() - box.min.z()) / step) + 2;
  const std::size_t first = mesh.vertices.size();
  std::vector<Vec3> points;
  for (std::size_t j = 0; j < up; ++j) {
    for (std::size_t i = 0; i < across; ++i)
      points.emplace_back(plane, box.min.y() + static_cast<double>(i) * step,
                          box.min.z() + static_cast<double>(j) * step);
  }
  std::vector<Vec3f> values(points.size());
  std::vector<float> weights(points.size());
  density.sample(points, {}, values, weights);
  const auto inside = [&](std::size_t p) { return weights[p] * values[p][0] > 0.5f; };
  mesh.vertices.insert(mesh.vertices.end(), points.begin(), points.end());
  for (std::size_t j = 0; j + 1 < up; ++j) {
    for (std::size_t i = 0; i + 1 < across; ++i) {
      const std::size_t p = j * across + i;
      const std::size_t corners[] = {p, p + 1, p + 1 + across, p + across};
      if (std::none_of(std::begin(corners), std::end(corners), inside)) continue;
      mesh.faces.emplace_back();
      for (const std::size_t corner : corners) mesh.faces.back().push_back(first + corner);
    }
  }
}

void write(const std::filesystem::path& path, const ColoredMesh& mesh, const SampledGrid& colors) {
  std::vector<Vec3f> values(mesh.vertices.size());
  std::vector<float> weights(mesh.vertices.size());
  colors.sample(mesh.vertices, {}, values, weights);
  std::ofstream out(path);
  out.precision(9);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    out << "v " << mesh.vertices[i].transpose() << ' ' << values[i].transpose() << '\n';
  for (const std::vector<std::size_t>& face : mesh.faces) {
    out << 'f';
    for (const std::size_t v : face) out << ' ' << v + 1;
    out << '\n';
  }
  if (!out.flush()) throw Error(Errc::io, "cannot write " + path.string());
}

void run(const std::filesystem::path& vdb, const std::filesystem::path& obj) {
  const SampledGrids grids(vdb);
  const SampledGrid *density = grids.find("density", false), *colors = grids.find("color", true);
  const std::optional<TriMesh> skin = grids.extractSurface();
  if (!density || !colors || !skin) throw Error(Errc::io, vdb.string() + " lacks surface, density or color");
  const Box box = boundingBox(*skin);
  const double plane = 0.5 * (box.min.x() + box.max.x());
  ColoredMesh mesh;
  addSkin(*skin, plane, mesh);
  addCut(*density, box, plane, mesh);
  write(obj, mesh, *colors);
}

}  // namespace
}  // namespace polestar

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: bench_cut_surface FILLED.vdb OUT.obj\n";
    return 2;
  }
  try {
    polestar::run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::cerr << "bench_cut_surface: " << error.what() << '\n';
    return 1;
  }
}
