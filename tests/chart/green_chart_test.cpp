#include "polestar/chart/green_chart.h"

#include <gtest/gtest.h>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "polestar/star/subdivide.h"
#include "support/exact_green.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::BallGreen;
using testing::starShape;

const Vec3 kPole(0.3, 0.2, -0.1);

TEST(GreenChart, LinesInABallAboutItsCenterAreStraight) {
  const TriMesh mesh = icosphere(3);
  const GreenChart chart = traceChart(solveGreen(starShape(mesh, Vec3(0, 0, 0))));
  const Foliation& f = chart.foliation();
  for (std::size_t i = 0; i < f.vertexCount; ++i) {
    for (std::size_t level = 1; level < f.levels.size(); ++level) {
      EXPECT_LT((f.node(level, i) / f.levels[level] - mesh.vertices[i]).norm(), 6e-3);  // the mesh is no ball
    }
    EXPECT_LT((chart.directions()[i] - mesh.vertices[i]).norm(), 3e-3);
  }
}

TEST(GreenChart, LinesKeepTheStreamFunctionOfTheExactField) {
  const BallGreen exact{kPole};
  const GreenChart chart = traceChart(solveGreen(starShape(icosphere(4), kPole)));
  const Foliation& f = chart.foliation();
  const Frame& frame = chart.green().shape().frame();
  double worst = 0, worstLevel = 0;
  for (std::size_t i = 0; i < f.vertexCount; ++i) {
    const double flux = exact.streamFunction(frame.toWorld(f.node(0, i)));
    for (std::size_t level = 1; level < f.levels.size(); ++level) {
      const Vec3 x = frame.toWorld(f.node(level, i));
      worst = std::max(worst, std::abs(exact.streamFunction(x) - flux));
      worstLevel = std::max(worstLevel, std::abs(testing::ballRadius(exact.green(x), exact.harmonicRadius()) -
                                                 f.levels[level]));
    }
    // At the center the image is seen along the axis, on the far side: the second term is constant there.
    const double limit = kPole.normalized().dot(chart.directions()[i]) + 1 / kPole.norm();
    worst = std::max(worst, std::abs(limit - flux));
  }
  EXPECT_LT(worst, 5e-3);
  EXPECT_LT(worstLevel, 2e-3);
  EXPECT_EQ(chart.report().cells.bad(), 0u);
  EXPECT_EQ(chart.report().directionFlips, 0u);
  EXPECT_EQ(chart.report().failed, 0u);
}

TEST(GreenChart, NodesCarryTheFieldAtTheirPlace) {
  ChartOptions options;
  options.firstStep = 0.02;
  const GreenChart chart = traceChart(solveGreen(starShape(smoothStar(2))), options);
  const Foliation& f = chart.foliation();
  const GreenFunction& green = chart.green();
  for (std::size_t id = f.vertexCount; id < f.nodes.size(); ++id) {
    double h;
    Vec3 gradient;
    green.field().evaluate({&f.nodes[id], 1}, {&h, 1}, {&gradient, 1});
    EXPECT_NEAR(chart.harmonic()[id], h, 1e-12);
    EXPECT_LT((chart.harmonicGradient()[id] - gradient).norm(), 1e-10);
    if (id == f.centerNode()) continue;
    const double radius = green.ballRadius(1 / f.nodes[id].norm() + h);
    // Above the starts of the traces nodes lie on straight ways, evenly, which G does not quite follow.
    const double level = f.levels[id / f.vertexCount];
    EXPECT_NEAR(radius, level, 1 - level < options.firstStep - 1e-12 ? 0.5 * (1 - level) : 1e-4);
  }
}

TEST(GreenChart, AnotherToleranceGivesTheSameLines) {
  const GreenFunction green = solveGreen(starShape(smoothStar(2)));
  ChartOptions fine;
  fine.tolerance = 1e-9;
  const GreenChart a = traceChart(green), b = traceChart(green, fine);
  double worst = 0;
  for (std::size_t id = 0; id < a.foliation().nodes.size(); ++id) {
    worst = std::max(worst, (a.foliation().nodes[id] - b.foliation().nodes[id]).norm());
  }
  EXPECT_LT(worst, 2e-5);
}

TEST(GreenChart, SameBytesForAnyNumberOfThreads) {
  const GreenFunction green = solveGreen(starShape(smoothStar(2)));
  std::vector<Vec3> one, two;
  withThreads(1, [&] { one = traceChart(green).foliation().nodes; });
  withThreads(2, [&] { two = traceChart(green).foliation().nodes; });
  EXPECT_EQ(one, two);
}

TEST(GreenChart, ATracerBeginsWithTheFirstLevelBelowItsStart) {
  const GreenFunction green = solveGreen(starShape(icosphere(2)));
  const FieldLineTracer tracer(green, 1e-6);
  const std::vector<double> levels{0.5, 0.2};
  const std::vector<Vec3> starts{{0.3, 0, 0}, {0.9, 0, 0}, {0.1, 0, 0}};
  const auto lines = tracer.trace(starts, levels);
  ASSERT_TRUE(lines[0].ok);
  EXPECT_EQ(lines[0].firstLevel, 1u);
  EXPECT_EQ(lines[0].nodes.size(), 1u);
  EXPECT_NEAR(lines[0].startRadius, 0.3, 1e-2);
  ASSERT_TRUE(lines[1].ok);
  EXPECT_EQ(lines[1].firstLevel, 0u);
  EXPECT_EQ(lines[1].nodes.size(), 2u);
  EXPECT_FALSE(lines[2].ok);
}

TEST(GreenChart, RejectsImpossibleOptions) {
  const GreenFunction green = solveGreen(starShape(icosphere(1)));
  for (auto spoil : std::initializer_list<void (*)(ChartOptions&)>{
           [](ChartOptions& o) { o.tolerance = 0; }, [](ChartOptions& o) { o.startDepth = -1; },
           [](ChartOptions& o) { o.innermost = 0.5; }, [](ChartOptions& o) { o.largestStep = 0; },
           [](ChartOptions& o) { o.firstStep = 0.9; }}) {
    ChartOptions options;
    spoil(options);
    EXPECT_THROW(traceChart(green, options), Error);
  }
}

TEST(GreenChart, RealModelsHaveNoInvertedCell) {
  POLESTAR_REQUIRE_MESHES();
  for (const char* name : {"castalia.obj", "psyche.obj", "sylvia.off"}) {
    const GreenChart chart =
        traceChart(solveGreen(testing::starShapeFromFile(*testing::meshFolder() / name)));
    EXPECT_EQ(chart.report().cells.bad(), 0u) << name;
    EXPECT_EQ(chart.report().directionFlips, 0u) << name;
  }
}

// Sharp ridges, nostrils, legs: what is missing are lines, and none has to be moved for it.
TEST(GreenChart, SharpRealModelsKeepTheirLines) {
  POLESTAR_REQUIRE_MESHES();
  for (const char* name : {"golevka.stl", "geographos.ply", "itokawa_16.obj"}) {
    const StarShape shape = subdivide(testing::starShapeFromFile(*testing::meshFolder() / name), 0.12);
    const GreenChart chart = traceChart(solveGreen(shape));
    EXPECT_EQ(chart.report().cells.bad(), 0u) << name;
    EXPECT_EQ(chart.report().directionFlips, 0u) << name;
    EXPECT_TRUE(chart.movedNodes().empty()) << name;
  }
}

}  // namespace
}  // namespace polestar
