#include "polestar/chart/detail/ray_zone.h"

#include <gtest/gtest.h>

#include <random>

#include "chart/cone.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

const std::vector<double> kLevels{1, 0.9, 0.75, 0.6, 0.4, 0.2};

// Lines of the vertices that `chosen` picks, turned at random about the center: distances are kept.
template <class Chosen>
Foliation scrambled(Chosen&& chosen) {
  Foliation f = testing::radialCone(smoothStar(3), kLevels);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (std::size_t v = 0; v < f.vertexCount; ++v) {
    if (!chosen(f.nodes[v])) continue;
    for (std::size_t level = 1; level < kLevels.size(); ++level) {
      Vec3& x = f.nodes[f.nodeId(level, v)];
      x = x.norm() *
          (x.normalized() + 0.6 * Vec3(normal(random), normal(random), normal(random))).normalized();
    }
  }
  return f;
}

TEST(BendTowardsRays, MendsAPatchOfNoiseAndLeavesTheRest) {
  Foliation f = scrambled([](const Vec3& v) { return v.normalized().z() > 0.93; });
  const Foliation before = f;
  ASSERT_GT(countCells(f).bad(), 300u);
  const RayZone zone = bendTowardsRays(f, Context::quiet());
  EXPECT_EQ(countCells(f).bad(), 0u);
  EXPECT_FALSE(zone.everywhere);
  EXPECT_GT(zone.lines, 10u);
  EXPECT_LT(zone.lines, f.vertexCount / 2);
  for (std::size_t v = 0; v < f.vertexCount; ++v) {
    EXPECT_EQ(f.nodes[v], before.nodes[v]);
    if (f.nodes[v].z() < 0) {
      EXPECT_EQ(f.node(3, v), before.node(3, v));
    }
  }
}

TEST(BendTowardsRays, EndsWithTheRadialConeWhereNothingElseHelps) {
  Foliation f = scrambled([](const Vec3&) { return true; });
  const RayZone zone = bendTowardsRays(f, Context::quiet());
  EXPECT_EQ(countCells(f).bad(), 0u);
  EXPECT_EQ(zone.lines, f.vertexCount);
  for (std::size_t v = 0; v < f.vertexCount; v += 50) EXPECT_LT(f.node(3, v).cross(f.nodes[v]).norm(), 1e-12);
}

}  // namespace
}  // namespace polestar::detail
