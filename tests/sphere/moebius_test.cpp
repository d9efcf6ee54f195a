#include "polestar/sphere/detail/moebius.h"

#include <gtest/gtest.h>

#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/laplacian.h"
#include "support.h"

namespace polestar {
namespace {

using detail::centerByMoebius;
using detail::moebiusTranslate;
using testing::largestDifferenceUpToRotation;

double crossRatio(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (a - b).norm() * (c - d).norm() / ((a - c).norm() * (b - d).norm());
}

TEST(Moebius, KeepsCrossRatiosAndTheSphere) {
  const Vec3 shift(0.3, -0.5, 0.2);
  const TriMesh mesh = icosphere(2);
  std::vector<Vec3> moved = mesh.vertices;
  moebiusTranslate(moved, shift);
  for (std::size_t i = 0; i + 3 < moved.size(); ++i) {
    EXPECT_NEAR(moved[i].norm(), 1, 1e-15);
    const double before =
        crossRatio(mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2], mesh.vertices[i + 3]);
    EXPECT_NEAR(crossRatio(moved[i], moved[i + 1], moved[i + 2], moved[i + 3]) / before, 1, 1e-12);
  }
  std::vector<Vec3> poles{shift.normalized(), -shift.normalized()};
  const std::vector<Vec3> before = poles;
  moebiusTranslate(poles, shift);
  EXPECT_LT(testing::largestDifference(poles, before), 1e-15);
  moebiusTranslate(moved, -shift);
  EXPECT_LT(testing::largestDifference(moved, mesh.vertices), 1e-14);
}

TEST(Moebius, CenteringUndoesAnyMoebiusMap) {
  // The icosphere's mean is 0 by symmetry, so it is what every Moebius image of it is centered to.
  const TriMesh mesh = icosphere(3);
  const std::vector<double> shares = detail::vertexAreaShares(mesh);
  for (const double strength : {0.1, 0.9, 0.999}) {
    std::vector<Vec3> moved = mesh.vertices;
    moebiusTranslate(moved, strength * Vec3(2, -1, 3).normalized());
    EXPECT_LT(centerByMoebius(moved, shares), 1e-14);
    EXPECT_LT(largestDifferenceUpToRotation(moved, mesh.vertices), 1e-12) << "strength " << strength;
  }
}

TEST(Moebius, CentersLopsidedWeights) {
  const TriMesh mesh = icosphere(3);
  std::vector<double> shares(mesh.vertices.size());
  double total = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) total += shares[i] = std::exp(4 * mesh.vertices[i][0]);
  for (double& share : shares) share /= total;
  std::vector<Vec3> moved = mesh.vertices;
  EXPECT_LT(centerByMoebius(moved, shares), 1e-14);
  Vec3 mean = Vec3::Zero();
  for (std::size_t i = 0; i < shares.size(); ++i) mean += shares[i] * moved[i];
  EXPECT_LT(mean.norm(), 1e-13);
}

}  // namespace
}  // namespace polestar
