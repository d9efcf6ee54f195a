#include <gtest/gtest.h>

#include <cmath>

#include "polestar/chart/green_chart.h"
#include "polestar/mesh/shapes.h"
#include "support/solids.h"

namespace polestar {
namespace {

// A coarse mesh of a body with a tall sharp ridge: lines from its sides meet below it.
TriMesh ridge() {
  return radialShape(3,
                     [](const Vec3& u) { return 1 + 3 * std::exp(-40 * u[1] * u[1]) * std::max(0.0, u[0]); });
}

TEST(LocalRefinement, AddsLinesInsteadOfMovingThem) {
  const GreenFunction green = solveGreen(testing::starShape(ridge()));
  const GreenChart chart = traceChart(green);
  const ChartReport& report = chart.report();
  EXPECT_GT(report.added, 0u);
  EXPECT_LT(report.added, 100u);
  EXPECT_EQ(report.cells.bad(), 0u);
  EXPECT_EQ(report.repaired + report.rayLines, 0u);
  EXPECT_TRUE(chart.movedNodes().empty());

  // The chart's surface is a refinement of the one that was given, and its Green's function the same.
  const TriMesh &fine = chart.green().shape().mesh(), &given = green.shape().mesh();
  ASSERT_EQ(fine.vertices.size(), given.vertices.size() + report.added);
  EXPECT_EQ(chart.foliation().vertexCount, fine.vertices.size());
  EXPECT_EQ(chart.foliation().triangles, fine.triangles);
  for (std::size_t i = 0; i < given.vertices.size(); ++i) EXPECT_EQ(fine.vertices[i], given.vertices[i]);
  EXPECT_EQ(&chart.green().field(), &green.field());
  const double volume = volumeProperties(given).volume;
  EXPECT_NEAR(volumeProperties(fine).volume, volume, 1e-12 * volume);

  // Every node lies on its level by the field, those of the added lines as well.
  const Foliation& f = chart.foliation();
  for (std::size_t v = given.vertices.size(); v < f.vertexCount; ++v) {
    for (std::size_t level = 1; level < f.levels.size(); ++level) {
      if (1 - f.levels[level] < 0.1) continue;  // above the starts
      double value;
      Vec3 gradient;
      chart.green().evaluate({&f.node(level, v), 1}, {&value, 1}, {&gradient, 1});
      EXPECT_NEAR(chart.green().ballRadius(value), f.levels[level], 1e-4);
    }
  }
}

TEST(LocalRefinement, LeavesASmoothBodyAlone) {
  const GreenChart chart = traceChart(solveGreen(testing::starShape(smoothStar(2))));
  EXPECT_EQ(chart.report().added, 0u);
}

}  // namespace
}  // namespace polestar
