#include "polestar/chart/untangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "chart/cone.h"
#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

const std::vector<double> kLevels{1, 0.95, 0.88, 0.8, 0.65, 0.5, 0.35, 0.2};

// Nodes of some lines thrown about by up to `share` of their distance from the center.
Foliation disturbed(double share, std::size_t stride) {
  Foliation f = testing::radialCone(smoothStar(3), kLevels);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-share, share);
  for (std::size_t v = 0; v < f.vertexCount; v += stride) {
    for (std::size_t level = 1; level < kLevels.size(); ++level) {
      Vec3& x = f.nodes[f.nodeId(level, v)];
      x += x.norm() * Vec3(uniform(random), uniform(random), uniform(random));
    }
  }
  return f;
}

TEST(Untangle, LeavesAGoodFoliationAlone) {
  Foliation f = testing::radialCone(smoothStar(2), kLevels);
  const std::vector<Vec3> before = f.nodes;
  const Untangling result = untangle(f, 4, Context::quiet());
  EXPECT_TRUE(result.movedNodes.empty());
  EXPECT_EQ(f.nodes, before);
}

TEST(Untangle, TurnsEveryCellOver) {
  Foliation f = disturbed(0.12, 40);
  const Foliation before = f;
  ASSERT_GT(countCells(f).bad(), 100u);
  const Untangling result = untangle(f, 4, Context::quiet());
  EXPECT_EQ(countCells(f).bad(), 0u);
  EXPECT_FALSE(result.movedNodes.empty());
  // What is not listed has not moved, and neither surface nor center has.
  double largest = 0;
  for (std::size_t id = 0; id < f.nodes.size(); ++id) {
    const bool listed = std::binary_search(result.movedNodes.begin(), result.movedNodes.end(), id);
    EXPECT_EQ(listed, f.nodes[id] != before.nodes[id]) << id;
    largest = std::max(largest, (f.nodes[id] - before.nodes[id]).norm());
  }
  EXPECT_GE(result.movedNodes.front(), f.vertexCount);
  EXPECT_LT(result.movedNodes.back(), f.centerNode());
  EXPECT_EQ(result.largestMove, largest);
}

TEST(Untangle, NeverMakesItWorse) {
  Foliation f = disturbed(1.5, 2);  // hopeless
  const std::size_t before = countCells(f).bad();
  untangle(f, 1, Context::quiet());
  EXPECT_LE(countCells(f).bad(), before);
}

TEST(Untangle, SameBytesForAnyNumberOfThreads) {
  Foliation one = disturbed(0.12, 40), two = one;
  withThreads(1, [&] { untangle(one, 2, Context::quiet()); });
  withThreads(2, [&] { untangle(two, 2, Context::quiet()); });
  EXPECT_EQ(one.nodes, two.nodes);
}

}  // namespace
}  // namespace polestar
