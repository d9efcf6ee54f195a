#include "tetgen.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "run_program.h"
#include "support/scratch_folder.h"

namespace polestar::bench {
namespace {

namespace fs = std::filesystem;

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

File open(const fs::path& path, const char* mode) {
  File file(std::fopen(path.c_str(), mode), &std::fclose);
  if (!file) throw std::runtime_error("tetgen: cannot open " + path.filename().string());
  return file;
}

void writeSmesh(const fs::path& path, const TriMesh& surface) {
  const File file = open(path, "w");
  std::fprintf(file.get(), "%zu 3 0 0\n", surface.vertices.size());
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    const Vec3& v = surface.vertices[i];
    std::fprintf(file.get(), "%zu %.17g %.17g %.17g\n", i, v[0], v[1], v[2]);
  }
  std::fprintf(file.get(), "%zu 0\n", surface.triangles.size());
  for (const Triangle& t : surface.triangles) std::fprintf(file.get(), "3 %d %d %d\n", t[0], t[1], t[2]);
  std::fprintf(file.get(), "0\n0\n");
}

/// Volume of the regular tetrahedron on the average triangle.
double targetVolume(const TriMesh& surface) {
  const double area = surfaceArea(surface) / static_cast<double>(surface.triangles.size());
  const double squaredEdge = 4 * area / std::sqrt(3.0);
  return std::pow(squaredEdge, 1.5) / (6 * std::sqrt(2.0));
}

[[noreturn]] void unreadable() { throw std::runtime_error("tetgen: its output cannot be read"); }

TetMesh readTetgen(const fs::path& nodes, const fs::path& elements) {
  TetMesh mesh;
  std::size_t count = 0;
  int first, second;
  {
    const File file = open(nodes, "r");
    if (std::fscanf(file.get(), "%zu 3 %d %d", &count, &first, &second) != 3 || first || second) unreadable();
    mesh.vertices.resize(count);
    for (Vec3& v : mesh.vertices) {
      if (std::fscanf(file.get(), "%*d %lf %lf %lf", &v[0], &v[1], &v[2]) != 3) unreadable();
    }
  }
  const File file = open(elements, "r");
  if (std::fscanf(file.get(), "%zu %d %d", &count, &first, &second) != 3 || first != 4 || second)
    unreadable();
  mesh.tetrahedra.resize(count);
  for (auto& t : mesh.tetrahedra) {
    if (std::fscanf(file.get(), "%*d %d %d %d %d", &t[0], &t[1], &t[2], &t[3]) != 4) unreadable();
  }
  return mesh;
}

}  // namespace

std::optional<TetMesh> tetrahedralize(const TriMesh& surface) {
  const test::ScratchFolder folder;
  writeSmesh(folder / "solid.smesh", surface);
  // p: a surface; Y: no points on it; q: quality; a: volume; z: count from 0; M: no merging of flat facets,
  // which would lose their vertices; F, B, Q: no more output than needed.
  std::array<char, 80> switches{};
  std::snprintf(switches.data(), switches.size(), "-pYq1.414a%.12fzFBQ", targetVolume(surface));
  const std::optional<int> status =
      runProgram({"tetgen", switches.data(), (folder / "solid.smesh").string()});
  if (!status) return std::nullopt;
  if (*status != 0) throw std::runtime_error(std::string("tetgen ") + switches.data() + " failed");
  TetMesh mesh = readTetgen(folder / "solid.1.node", folder / "solid.1.ele");
  mesh.surfaceVertices = surface.vertices.size();
  return mesh;
}

}  // namespace polestar::bench
