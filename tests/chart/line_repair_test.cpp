#include "polestar/chart/detail/line_repair.h"

#include <gtest/gtest.h>

#include "chart/cone.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

const std::vector<double> kLevels{1, 0.9, 0.8, 0.6, 0.4, 0.2};
const Retrace kNoBetterStart = [](const std::set<std::int32_t>&, int) {};

TEST(RepairLines, LeavesAGoodFoliationAlone) {
  Foliation f = testing::radialCone(smoothStar(2), kLevels);
  const std::vector<Vec3> before = f.nodes;
  const LineRepair repair = repairLines(f, {}, kNoBetterStart);
  EXPECT_EQ(repair.lines, 0u);
  EXPECT_TRUE(repair.movedNodes.empty());
  EXPECT_EQ(f.nodes, before);
}

TEST(RepairLines, ReplacesALineThatWentAstray) {
  Foliation f = testing::radialCone(smoothStar(3), kLevels);
  const std::vector<Vec3> good = f.nodes;
  // Vertex 20 follows the line of a vertex on the other side.
  for (std::size_t level = 1; level < kLevels.size(); ++level) {
    f.nodes[f.nodeId(level, 20)] = f.node(level, 500);
  }
  EXPECT_GT(countCells(f).bad(), 0u);
  const LineRepair repair = repairLines(f, {}, kNoBetterStart);
  EXPECT_EQ(repair.badCells, 0u);
  EXPECT_GE(repair.lines, 1u);
  for (const std::size_t id : repair.movedNodes) EXPECT_LT((f.nodes[id] - good[id]).norm(), 0.05);
  for (std::size_t i = 0; i < f.vertexCount; ++i) EXPECT_EQ(f.node(0, i), good[i]);
}

TEST(RepairLines, PrefersAnotherStart) {
  Foliation f = testing::radialCone(smoothStar(3), kLevels);
  const std::vector<Vec3> good = f.nodes;
  for (std::size_t level = 1; level < kLevels.size(); ++level)
    f.nodes[f.nodeId(level, 20)] = f.node(level, 500);
  std::vector<int> attempts;
  const LineRepair repair = repairLines(f, {}, [&](const std::set<std::int32_t>& vertices, int attempt) {
    attempts.push_back(attempt);
    if (attempt == 0) return;  // fails again from there
    for (const std::int32_t v : vertices) {
      for (std::size_t level = 1; level < kLevels.size(); ++level)
        f.nodes[f.nodeId(level, v)] = good[f.nodeId(level, v)];
    }
  });
  EXPECT_EQ(attempts, (std::vector<int>{0, 1}));
  EXPECT_EQ(repair.badCells, 0u);
  EXPECT_GE(repair.retraced, 1u);
  EXPECT_EQ(repair.lines, 0u);
  EXPECT_TRUE(repair.movedNodes.empty());
  EXPECT_EQ(f.nodes, good);
}

TEST(RepairLines, FillsLinesThatWereNeverTraced) {
  Foliation f = testing::radialCone(icosphere(3), kLevels);
  std::vector<std::int32_t> failed{0, 1, 2, 3, 100, 101, 102};
  for (const std::int32_t v : failed) {
    for (std::size_t level = 1; level < kLevels.size(); ++level) f.nodes[f.nodeId(level, v)] = Vec3(9, 9, 9);
  }
  const LineRepair repair = repairLines(f, failed, kNoBetterStart);
  EXPECT_EQ(repair.badCells, 0u);
  EXPECT_EQ(repair.lines, 0u);
  EXPECT_EQ(repair.movedNodes.size(), failed.size() * (kLevels.size() - 1));
}

TEST(RepairLines, NeverMakesItWorse) {
  Foliation f = testing::radialCone(icosphere(2), kLevels);
  for (std::size_t i = 0; i < f.vertexCount; i += 3) f.nodes[f.nodeId(3, i)] *= -1;  // hopeless
  const std::size_t before = countCells(f).bad();
  EXPECT_LE(repairLines(f, {}, kNoBetterStart).badCells, before);
}

}  // namespace
}  // namespace polestar::detail
