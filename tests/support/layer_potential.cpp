#include "support/layer_potential.h"

#include <cmath>

namespace polestar::testing {
namespace {

double trianglePotential(const std::array<Vec3, 3>& corner, const std::array<double, 3>& density,
                         const Vec3& x) {
  const Vec3 areaVector = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  const Vec3 normal = areaVector.normalized();
  const double height = normal.dot(x - corner[0]), far = std::abs(height);
  const Vec3 foot = x - height * normal;
  double constant = 0;         // integral of 1/r
  Vec3 linear = Vec3::Zero();  // integral of (y - foot)/r
  Vec3 slope = Vec3::Zero();   // of the density
  double atFoot = density[0];
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = corner[(k + 1) % 3] - corner[k], along = edge.normalized(),
               across = along.cross(normal);
    slope -= density[(k + 2) % 3] / areaVector.norm() * edge.cross(normal);
    const double before = along.dot(corner[k] - foot), after = along.dot(corner[(k + 1) % 3] - foot);
    const double offset = across.dot(corner[k] - foot), squared = offset * offset + height * height;
    const double start = (corner[k] - x).norm(), end = (corner[(k + 1) % 3] - x).norm();
    double log = 0;  // integral of 1/r along the edge
    if (squared > 1e-30)
      log = std::asinh(after / std::sqrt(squared)) - std::asinh(before / std::sqrt(squared));
    constant += offset * log;
    if (far > 0) {
      constant -= far * (std::atan(offset * after / (squared + far * end)) -
                         std::atan(offset * before / (squared + far * start)));
    }
    linear += 0.5 * across * (squared * log + after * end - before * start);
  }
  atFoot += slope.dot(foot - corner[0]);
  return atFoot * constant + slope.dot(linear);
}

}  // namespace

double layerPotential(const TriMesh& mesh, std::span<const double> density, const Vec3& x) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<double, 3> sigma{};
    for (int k = 0; k < 3; ++k) sigma[k] = density[mesh.triangles[t][k]];
    sum += trianglePotential({mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)}, sigma, x);
  }
  return sum;
}

}  // namespace polestar::testing
