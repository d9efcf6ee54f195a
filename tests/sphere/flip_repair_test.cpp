#include "polestar/sphere/detail/flip_repair.h"

#include <gtest/gtest.h>

#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/conformal.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/sphere_quality.h"
#include "support.h"

namespace polestar {
namespace {

using detail::repairFlips;
using testing::withNeedles;

TEST(FlipRepair, UnfoldsAPatchAndLeavesTheRestAlone) {
  const TriMesh mesh = smoothStar(4);
  const std::vector<Vec3> good = detail::conformalMap(mesh, {}, Context::quiet()).directions;
  const std::int32_t v = 700;
  std::vector<Vec3> folded = good;
  for (const Triangle& t : mesh.triangles) {  // pull a vertex across a neighbour
    for (int k = 0; k < 3; ++k) {
      if (t[k] == v) folded[v] = (good[v] + 2.5 * (good[t[(k + 1) % 3]] - good[v])).normalized();
    }
  }
  const double pulled = (folded[v] - good[v]).norm();
  ASSERT_GT(countFlips(folded, mesh.triangles), 0u);

  std::vector<Vec3> repaired = folded;
  const auto outcome = repairFlips(mesh, detail::vertexAreaShares(mesh), 2, repaired, Context::quiet());
  EXPECT_TRUE(outcome.repaired);
  EXPECT_EQ(countFlips(repaired, mesh.triangles), 0u);
  std::size_t moved = 0;
  for (std::size_t i = 0; i < good.size(); ++i) moved += repaired[i] != good[i];
  EXPECT_LE(moved, outcome.freeVertices);
  EXPECT_LT(outcome.freeVertices, 100u);
  EXPECT_LT((repaired[v] - good[v]).norm(), 0.1 * pulled);
  EXPECT_LT(detail::angleDistortion(mesh, repaired).mean, detail::angleDistortion(mesh, good).mean + 1e-3);
}

TEST(FlipRepair, ChangesNothingWhenItFails) {
  const TriMesh mesh = icosphere(2);
  std::vector<Vec3> mirrored = mesh.vertices;
  for (Vec3& s : mirrored) s[2] = -s[2];
  std::vector<Vec3> directions = mirrored;
  const auto outcome = repairFlips(mesh, detail::vertexAreaShares(mesh), 0, directions, Context::quiet());
  EXPECT_FALSE(outcome.repaired);
  EXPECT_TRUE(directions == mirrored);
}

TEST(FlipRepair, SaysWhenDoublesDoNotResolveTheImage) {
  const TriMesh mesh = icosphere(2);
  std::vector<Vec3> collapsed(mesh.vertices.size(), Vec3::UnitX());
  const auto outcome = repairFlips(mesh, detail::vertexAreaShares(mesh), 2, collapsed, Context::quiet());
  EXPECT_FALSE(outcome.repaired);
  EXPECT_TRUE(outcome.crowded);
}

TEST(FlipRepair, NeedlesDoNotSpoilTheMap) {
  // Needles in flat triangles leave the surface, so the conformal map, as it was.
  const TriMesh plain = smoothStar(4);
  const SphereMap reference = detail::conformalMap(plain, {}, Context::quiet());
  for (const double height : {1e-2, 1e-5}) {
    const TriMesh mesh = withNeedles(plain, 200, height, 11);
    ASSERT_EQ(detail::radialMap(mesh).flips, 0u);
    const SphereMap map = detail::conformalMap(mesh, {}, Context::quiet());
    EXPECT_EQ(map.fallbackReason, "");
    EXPECT_EQ(map.flips, 0u);
    EXPECT_GT(map.repairedVertices, 0u);
    EXPECT_NEAR(map.qcMean, reference.qcMean, 0.02);
    const std::vector<Vec3> old(map.directions.begin(), map.directions.begin() + plain.vertices.size());
    EXPECT_LT(testing::largestDifferenceUpToRotation(old, reference.directions), 0.03);  // an edge is 0.07
  }
}

}  // namespace
}  // namespace polestar
