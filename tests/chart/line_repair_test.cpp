#include "polestar/chart/detail/line_repair.h"

#include <gtest/gtest.h>

#include <limits>

#include "chart/cone.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

const std::vector<double> kLevels{1, 0.9, 0.8, 0.6, 0.4, 0.2};

TEST(ReplaceLines, LeavesAGoodFoliationAlone) {
  Foliation f = testing::radialCone(smoothStar(2), kLevels);
  const std::vector<Vec3> before = f.nodes;
  const ReplacedLines replaced = replaceLines(f);
  EXPECT_TRUE(replaced.lines.empty());
  EXPECT_EQ(replaced.badCells, 0u);
  EXPECT_EQ(f.nodes, before);
}

TEST(ReplaceLines, ReplacesALineThatWentAstray) {
  Foliation f = testing::radialCone(smoothStar(3), kLevels);
  const std::vector<Vec3> good = f.nodes;
  // Vertex 20 follows the line of a vertex on the other side.
  for (std::size_t level = 1; level < kLevels.size(); ++level) {
    f.nodes[f.nodeId(level, 20)] = f.node(level, 500);
  }
  EXPECT_GT(countCells(f).bad(), 0u);
  const ReplacedLines replaced = replaceLines(f);
  EXPECT_EQ(replaced.badCells, 0u);
  EXPECT_EQ(replaced.lines.count(20), 1u);
  for (std::size_t id = 0; id < f.nodes.size(); ++id) {
    const auto vertex = static_cast<std::int32_t>(id % f.vertexCount);
    if (id < f.vertexCount || !replaced.lines.count(vertex)) {
      EXPECT_EQ(f.nodes[id], good[id]);
    } else {
      EXPECT_LT((f.nodes[id] - good[id]).norm(), 0.05);
    }
  }
}

TEST(RetraceLines, TakesTheStartThatHelps) {
  Foliation f = testing::radialCone(smoothStar(3), kLevels);
  const std::vector<Vec3> good = f.nodes;
  for (std::size_t level = 1; level < kLevels.size(); ++level)
    f.nodes[f.nodeId(level, 20)] = f.node(level, 500);
  std::vector<int> attempts;
  const RetracedLines again = retraceLines(f, [&](const std::set<std::int32_t>& vertices, int attempt) {
    attempts.push_back(attempt);
    if (attempt == 0) return;  // fails again from there
    for (const std::int32_t v : vertices) {
      for (std::size_t level = 1; level < kLevels.size(); ++level)
        f.nodes[f.nodeId(level, v)] = good[f.nodeId(level, v)];
    }
  });
  EXPECT_EQ(attempts, (std::vector<int>{0, 1}));
  EXPECT_GE(again.kept, 1u);
  EXPECT_EQ(again.touched.count(20), 1u);
  EXPECT_EQ(f.nodes, good);
}

TEST(RetraceLines, UndoesWhatDoesNotHelp) {
  Foliation f = testing::radialCone(smoothStar(3), kLevels);
  for (std::size_t level = 1; level < kLevels.size(); ++level)
    f.nodes[f.nodeId(level, 20)] = f.node(level, 500);
  const std::vector<Vec3> before = f.nodes;
  int attempts = 0;
  const RetracedLines again = retraceLines(f, [&](const std::set<std::int32_t>& vertices, int) {
    ++attempts;
    for (const std::int32_t v : vertices) f.nodes[f.nodeId(2, static_cast<std::size_t>(v))] *= -1;
  });
  EXPECT_EQ(attempts, kRetraces);
  EXPECT_EQ(again.kept, 0u);
  EXPECT_FALSE(again.touched.empty());
  EXPECT_EQ(f.nodes, before);
}

TEST(FillLines, FillsLinesThatWereNeverTraced) {
  Foliation f = testing::radialCone(icosphere(3), kLevels);
  std::vector<std::int32_t> failed{0, 1, 2, 3, 100, 101, 102};
  for (const std::int32_t v : failed) {
    for (std::size_t level = 1; level < kLevels.size(); ++level) f.nodes[f.nodeId(level, v)] = Vec3(9, 9, 9);
  }
  fillLines(f, failed);
  EXPECT_EQ(countCells(f).bad(), 0u);
}

TEST(FillLines, OneTracedNeighbourIsEnough) {
  Foliation f = testing::radialCone(icosphere(2), kLevels);
  // All lines but one are missing: the front begins at vertices that see that one alone.
  std::vector<std::int32_t> failed;
  for (std::size_t v = 1; v < f.vertexCount; ++v) {
    failed.push_back(static_cast<std::int32_t>(v));
    for (std::size_t level = 1; level < kLevels.size(); ++level)
      f.nodes[f.nodeId(level, v)].setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  fillLines(f, failed);
  for (const Vec3& node : f.nodes) EXPECT_TRUE(node.allFinite());
}

TEST(ReplaceLines, NeverMakesItWorse) {
  Foliation f = testing::radialCone(icosphere(2), kLevels);
  for (std::size_t i = 0; i < f.vertexCount; i += 3) f.nodes[f.nodeId(3, i)] *= -1;  // hopeless
  const std::size_t before = countCells(f).bad();
  EXPECT_LE(replaceLines(f).badCells, before);
  EXPECT_LE(countCells(f).bad(), before);
}

}  // namespace
}  // namespace polestar::detail
