#include "polestar/map/detail/core_isotopy.h"

#include <gtest/gtest.h>

#include "polestar/mesh/shapes.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar::detail {
namespace {

TEST(CoreIsotopy, IsPhiOutsideARotationInsideAndFlipFreeBetween) {
  const TriMesh sphere = icosphere(3);
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  std::vector<Vec3> phi;
  for (const Vec3& w : sphere.vertices)
    phi.push_back((turn * Vec3(1.6 * w[0], w[1], 0.8 * w[2])).normalized());
  const std::vector<double> weight(phi.size(), 1.0);
  const CoreIsotopy isotopy(sphere.vertices, phi, weight, 0.25);
  // The stretch is symmetric, so the best rotation is the turn itself.
  EXPECT_LT((isotopy.rotation() - turn).norm(), 1e-2);

  for (const double radius : {1.0, 0.5, 0.25, 0.2, 0.15, 0.1, 0.07, 0.0625, 0.03, 0.0}) {
    std::vector<Vec3> direction;
    for (std::size_t i = 0; i < phi.size(); ++i) {
      direction.push_back(isotopy.direction(radius, sphere.vertices[i], phi[i]));
      if (radius >= 0.25) {
        EXPECT_EQ(direction[i], phi[i]);
      } else if (radius <= 0.0625) {
        EXPECT_LT((direction[i] - isotopy.rotation() * sphere.vertices[i]).norm(), 1e-14);
      }
    }
    EXPECT_EQ(countFlips(direction, sphere.triangles), 0u) << "at R = " << radius;
  }
}

TEST(CoreIsotopy, WithoutACoreItIsPhiEverywhere) {
  const TriMesh sphere = icosphere(1);
  const std::vector<double> weight(sphere.vertices.size(), 1.0);
  std::vector<Vec3> phi(sphere.vertices.rbegin(), sphere.vertices.rend());
  const CoreIsotopy isotopy(sphere.vertices, phi, weight, 0);
  EXPECT_EQ(isotopy.direction(0.001, sphere.vertices[3], phi[3]), phi[3]);
}

}  // namespace
}  // namespace polestar::detail
