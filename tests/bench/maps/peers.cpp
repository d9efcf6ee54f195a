#include "peers.h"

#include <optional>
#include <stdexcept>

#include "polestar/sphere/sphere_locator.h"
#include "tet_laplacian.h"

namespace polestar::bench {

std::vector<Vec3> imagesByMap(const TetMesh& mesh, const BallMap& map) {
  const Frame& frame = map.chart().green().shape().frame();
  std::vector<Vec3> image = map.sphere().directions, inside;
  for (std::size_t i = mesh.surfaceVertices; i < mesh.vertices.size(); ++i)
    inside.push_back(frame.toWorld(mesh.vertices[i]));
  std::vector<Vec3> moved(inside.size());
  map.forward(inside, moved);
  for (const Vec3& p : moved) {
    if (!p.allFinite()) throw std::runtime_error("the map has no value at a vertex inside the solid");
  }
  image.insert(image.end(), moved.begin(), moved.end());
  return image;
}

std::vector<Vec3> imagesByCone(const TetMesh& mesh, const TriMesh& surface) {
  const SphereLocator locator(surface.vertices, surface.triangles);
  std::vector<Vec3> image;
  for (const Vec3& x : mesh.vertices) {
    if (image.size() < mesh.surfaceVertices) {
      image.push_back(x.normalized());
      continue;
    }
    const std::optional<SphereLocator::Hit> hit = locator.locate(x.isZero(0) ? Vec3::UnitX() : x);
    if (!hit) throw std::runtime_error("a ray from the center misses the surface");
    image.push_back(x / locator.point(*hit).norm());
  }
  return image;
}

std::vector<Vec3> imagesByHarmonicMap(const TetMesh& mesh, std::span<const Vec3> boundary) {
  std::vector<Vec3> image(mesh.vertices.size());
  std::vector<double> values(boundary.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < boundary.size(); ++i) values[i] = boundary[i][axis];
    const TetSolution solution = solveTetLaplacian(mesh, values, 1e-9);
    for (std::size_t i = 0; i < image.size(); ++i) image[i][axis] = solution.h[i];
  }
  return image;
}

}  // namespace polestar::bench
