#include "support/solids.h"

#include <cmath>
#include <random>

#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/repair.h"
#include "polestar/pipeline.h"

namespace polestar::testing {

StarShape starShape(const TriMesh& mesh, std::optional<Vec3> center) {
  StarOptions options;
  options.center = center;
  options.rays = 0;
  return verifyStarShape(verifyClosedSurface(mesh), options);
}

StarShape starShapeFromFile(const std::filesystem::path& path) {
  return starShape(repairMesh(readMesh(path).mesh).mesh);
}

BallMap ballMap(const StarShape& shape) { return mapToBall(shape); }

std::vector<Vec3> pointsInside(const StarShape& shape, std::size_t count, unsigned seed) {
  const TriMesh& mesh = shape.surface().mesh();
  const Vec3& center = shape.frame().origin;
  std::vector<double> area(mesh.triangles.size());
  for (std::size_t t = 0; t < area.size(); ++t) area[t] = areaVector(mesh, t).norm();
  std::mt19937 random(seed);
  std::discrete_distribution<std::size_t> triangle(area.begin(), area.end());
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t t = triangle(random);
    double u = uniform(random), v = uniform(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3 q = (1 - u - v) * mesh.corner(t, 0) + u * mesh.corner(t, 1) + v * mesh.corner(t, 2);
    points.push_back(center + std::cbrt(uniform(random)) * (q - center));
  }
  return points;
}

}  // namespace polestar::testing
