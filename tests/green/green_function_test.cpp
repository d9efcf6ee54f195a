#include "polestar/green/green_function.h"

#include <gtest/gtest.h>

#include <numbers>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "support/exact_green.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::BallGreen;
using testing::ballRadius;
using testing::CubeGreen;
using testing::HalfBallGreen;
using testing::pointsInside;
using testing::starShape;

const Vec3 kBallPole(0.3, 0.2, -0.1), kHalfBallPole(0.1, 0, 0.4), kCubePole(0.2, 0.1, -0.15);

/// max |R - R_exact| at points inside, R from the solver.
template <class Exact>
double radiusError(const GreenFunction& green, const Exact& exact, std::size_t count) {
  const Frame& frame = green.shape().frame();
  const std::vector<Vec3> points = pointsInside(green.shape(), count);
  double worst = 0;
  for (const Vec3& x : points) {
    const Vec3 inner = frame.toInner(x);
    double value;
    Vec3 gradient;
    green.evaluate({&inner, 1}, {&value, 1}, {&gradient, 1});
    worst = std::max(worst,
                     std::abs(green.ballRadius(value) - ballRadius(exact.green(x), exact.harmonicRadius())));
  }
  return worst;
}

// No refinement: the rates below are those of a given mesh.
GreenOptions onePass() {
  GreenOptions options;
  options.maxPasses = 1;
  return options;
}

TEST(GreenFunction, BallWithOffCenterPoleConvergesToTheKelvinImage) {
  const BallGreen exact{kBallPole};
  const double coarse = radiusError(solveGreen(starShape(icosphere(4), kBallPole), onePass()), exact, 1000);
  const GreenFunction green = solveGreen(starShape(icosphere(5), kBallPole), onePass());
  const double fine = radiusError(green, exact, 1000);
  EXPECT_LT(fine, 2e-3);
  // Second order in the edge length: halving it, as a level does, divides the error by four.
  EXPECT_GT(coarse / fine, 3);
  EXPECT_NEAR(green.charge().value(), -1, 1e-4);
  EXPECT_NEAR(green.harmonicRadius() * green.shape().frame().unit, exact.harmonicRadius(), 1e-3);
  EXPECT_EQ(green.record().unresolvedArea, 0);
}

TEST(GreenFunction, BallDensityIsThePoissonKernel) {
  const TriMesh mesh = icosphere(4);
  const GreenFunction green = solveGreen(starShape(mesh, kBallPole), onePass());
  const double unit = green.shape().frame().unit;
  double worst = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const double exact = BallGreen{kBallPole}.harmonicMeasure(mesh.vertices[i]);
    worst = std::max(worst, std::abs(-green.density()[i] / (unit * unit) / exact - 1));
  }
  EXPECT_LT(worst, 0.05);
}

TEST(GreenFunction, HalfBallAgainstFourImages) {
  const HalfBallGreen exact{kHalfBallPole};
  const double coarse =
      radiusError(solveGreen(starShape(halfBall(20), kHalfBallPole), onePass()), exact, 1000);
  const double fine = radiusError(solveGreen(starShape(halfBall(41), kHalfBallPole), onePass()), exact, 1000);
  EXPECT_LT(fine, 6e-3);
  EXPECT_GT(coarse / fine, 2.5);
}

TEST(GreenFunction, CubeAgainstItsLatticeOfImages) {
  const CubeGreen exact{kCubePole};
  const GreenFunction coarse = solveGreen(starShape(cube(20), kCubePole), onePass());
  const GreenFunction fine = solveGreen(starShape(cube(40), kCubePole), onePass());
  EXPECT_LT(radiusError(fine, exact, 25), 1e-3);
  // The faces are flat, so what is left is the layer's own error: second order as well.
  auto error = [&](const GreenFunction& green) {
    return std::abs(green.harmonicRadius() * green.shape().frame().unit - exact.harmonicRadius());
  };
  EXPECT_GT(error(coarse) / error(fine), 3);
}

TEST(GreenFunction, CubeHasTheMadelungConstantAtItsCenter) {
  const GreenFunction green = solveGreen(starShape(cube(40), Vec3(0, 0, 0)), onePass());
  // h of the unit cube; the mesh has side 2.
  const double h = -2 / (green.harmonicRadius() * green.shape().frame().unit);
  EXPECT_NEAR(h, -1.74756459, 5e-6);
}

TEST(GreenFunction, ObeysTheMaximumPrinciple) {
  const GreenFunction green = solveGreen(starShape(smoothStar(3)));
  const TriMesh& mesh = green.shape().mesh();
  double low = 0, high = -1e300;
  for (const Vec3& v : mesh.vertices) {
    low = std::min(low, -1 / v.norm());
    high = std::max(high, -1 / v.norm());
  }
  std::vector<Vec3> points = pointsInside(green.shape(), 2000);
  for (Vec3& x : points) x = green.shape().frame().toInner(x);
  std::vector<double> h(points.size());
  std::vector<Vec3> gradient(points.size());
  green.field().evaluate(points, h, gradient);
  const double slack = green.boundaryError().max / green.harmonicRadius();
  for (const double value : h) {
    EXPECT_GT(value, low - slack);
    EXPECT_LT(value, high + slack);
  }
}

TEST(GreenFunction, AtTheCenterItIsInfinite) {
  const GreenFunction green = solveGreen(starShape(icosphere(2)), onePass());
  const Vec3 center = Vec3::Zero();
  double value;
  Vec3 gradient;
  green.evaluate({&center, 1}, {&value, 1}, {&gradient, 1});
  EXPECT_EQ(value, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(gradient.hasNaN());
  EXPECT_EQ(green.ballRadius(value), 0);
}

TEST(GreenFunction, SplitsUntilTheToleranceHolds) {
  const StarShape shape = starShape(halfBall(12), kHalfBallPole);
  GreenOptions options;
  options.maxPasses = 1;
  const GreenFunction first = solveGreen(shape, options);
  EXPECT_GT(first.boundaryError().max, 3 * options.tolerance);
  EXPECT_EQ(first.record().summary.stop, "passes spent");
  options.maxPasses = 8;
  const GreenFunction refined = solveGreen(shape, options);
  EXPECT_LE(refined.boundaryError().max, options.tolerance);
  EXPECT_EQ(refined.record().summary.stop, "tolerance reached");
  EXPECT_NEAR(refined.charge().value(), -1, 1e-4);
  for (std::size_t i = 0; i < shape.mesh().vertices.size(); ++i) {
    ASSERT_EQ(refined.layerMesh().vertices[i], shape.mesh().vertices[i]);
  }
}

// In the corners of a cube G rises with the third power of the distance: an error of the tolerance would be
// all that lines see there.
TEST(GreenFunction, ErrorsStayFarBelowGInCorners) {
  const int divisions = 6;
  const StarShape shape = starShape(cube(divisions), kCubePole);
  const GreenFunction green = solveGreen(shape);
  EXPECT_EQ(green.record().summary.stop, "tolerance reached");
  const double width = 2.0 / divisions / shape.frame().unit;  // of the given triangles
  const TriMesh& mesh = green.layerMesh();
  std::vector<Vec3> points;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 sum = mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2);
    for (int k = 0; k < 3; ++k) points.push_back((sum + 3 * mesh.corner(t, k)) / 6);
  }
  std::vector<double> value(points.size());
  std::vector<Vec3> gradient(points.size());
  green.evaluate(points, value, gradient);
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Triangle& t = mesh.triangles[i / 3];
    const double slope = 4 * std::numbers::pi / 3 *
                         std::abs(green.density()[t[0]] + green.density()[t[1]] + green.density()[t[2]]);
    if (green.harmonicRadius() * std::abs(value[i]) < 0.02 * GreenOptions().tolerance) continue;  // let be
    worst = std::max(worst, std::abs(value[i]) / (slope * width));
  }
  EXPECT_LT(worst, 0.05);
}

TEST(GreenFunction, SaysWhenTheBudgetIsSpent) {
  GreenOptions options;
  options.tolerance = 1e-5;
  options.growth = 1;
  options.spareVertices = 200;
  const StarShape shape = starShape(halfBall(12), kHalfBallPole);
  const GreenFunction green = solveGreen(shape, options);
  EXPECT_EQ(green.record().summary.stop, "budget spent");
  EXPECT_GT(green.boundaryError().max, options.tolerance);
  EXPECT_LE(green.layerMesh().vertices.size(), shape.mesh().vertices.size() + 200);
}

TEST(GreenFunction, SpendsWhatIsLeftOfTheBudgetWhereTheErrorIsLargest) {
  const StarShape shape = starShape(cube(4), kCubePole);
  GreenOptions options = onePass();
  const double unsplit = solveGreen(shape, options).boundaryError().max;
  options.maxPasses = 8;
  options.tolerance = 1e-5;  // far beyond the budget
  options.growth = 1;
  options.spareVertices = 600;
  const GreenFunction green = solveGreen(shape, options);
  EXPECT_EQ(green.record().summary.stop, "budget spent");
  const std::size_t most = shape.mesh().vertices.size() + 600;
  EXPECT_LE(green.layerMesh().vertices.size(), most);
  EXPECT_GE(green.layerMesh().vertices.size(), most - 150);  // a round of splits comes as a whole
  EXPECT_LT(green.boundaryError().max, 0.4 * unsplit);
}

// A vertex a thousandth of the height above the middle of an edge: triangles of aspect ratio 1:1000.
TriMesh withNeedles(TriMesh mesh, std::size_t every) {
  const std::size_t count = mesh.triangles.size();
  for (std::size_t t = 0; t < count; t += every) {
    const auto [a, b, c] = mesh.triangles[t];
    const Vec3 middle = 0.5 * (mesh.vertices[a] + mesh.vertices[b]);
    const auto v = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.push_back(middle + 1e-3 * (mesh.vertices[c] - middle));
    mesh.triangles[t] = {a, b, v};
    mesh.triangles.push_back({b, c, v});
    mesh.triangles.push_back({c, a, v});
  }
  return mesh;
}

TEST(GreenFunction, NeedlesDoNotStopIt) {
  const TriMesh ball = icosphere(4);
  const GreenFunction even = solveGreen(starShape(ball, kBallPole), onePass());
  const GreenFunction needles = solveGreen(starShape(withNeedles(ball, 7), kBallPole), onePass());
  EXPECT_LT(needles.record().summary.iterations, 2 * even.record().summary.iterations);
  EXPECT_LT(needles.boundaryError().max, 2 * even.boundaryError().max);
  EXPECT_NEAR(needles.charge().value(), -1, 1e-4);
  const BallGreen exact{kBallPole};
  EXPECT_LT(radiusError(needles, exact, 1000), 1.5 * radiusError(even, exact, 1000));
}

TEST(GreenFunction, NarrowPartsKeepTheirDigits) {
  // A bar of 6 x 1 x 1: G falls by e^(-pi sqrt(2) 2.5) = 1.5e-5 from the middle to half a width before its
  // end, and once more towards it: the residual that is good enough elsewhere would be noise there.
  constexpr double kLength = 6;
  TriMesh mesh = cube(24);
  for (Vec3& v : mesh.vertices) v = Vec3(kLength / 2 * v[0], 0.5 * v[1], 0.5 * v[2]);
  const GreenFunction green = solveGreen(starShape(mesh, Vec3(0, 0, 0)));
  EXPECT_LT(green.record().accuracy, 1e-7);
  EXPECT_LE(green.record().summary.residual, green.record().accuracy);
  EXPECT_LT(green.record().unresolvedArea, 0.01);
  // On the axis ln G is straight, with the slope of the first mode of a square tube.
  const double unit = green.shape().frame().unit;
  std::vector<Vec3> points;
  for (const double x : {1.3, 1.8, 2.3}) points.push_back(Vec3(x, 0, 0) / unit);
  std::vector<double> value(points.size());
  std::vector<Vec3> gradient(points.size());
  green.evaluate(points, value, gradient);
  const double slope = std::numbers::pi * std::numbers::sqrt2;
  EXPECT_NEAR(std::log(value[0] / value[1]) / 0.5, slope, 0.02 * slope);
  EXPECT_NEAR(std::log(value[1] / value[2]) / 0.5, slope, 0.02 * slope);
}

TEST(GreenFunction, SameBytesForAnyNumberOfThreads) {
  const StarShape shape = starShape(smoothStar(3));
  std::vector<double> one, two;
  withThreads(1, [&] {
    const GreenFunction green = solveGreen(shape);
    one.assign(green.density().begin(), green.density().end());
  });
  withThreads(2, [&] {
    const GreenFunction green = solveGreen(shape);
    two.assign(green.density().begin(), green.density().end());
  });
  EXPECT_EQ(one, two);
}

TEST(GreenFunction, RestoredFromItsDensityItIsTheSame) {
  const GreenFunction green = solveGreen(starShape(smoothStar(2)));
  const GreenFunction again = restoreGreen(green.shape(), green.sources(), green.record());
  const Vec3 x(0.1, 0.2, -0.3);
  double a, b;
  Vec3 gradient;
  green.evaluate({&x, 1}, {&a, 1}, {&gradient, 1});
  again.evaluate({&x, 1}, {&b, 1}, {&gradient, 1});
  EXPECT_EQ(a, b);
}

TEST(GreenFunction, ToleranceReachedInTheLastPassIsReached) {
  GreenOptions options;
  options.maxPasses = 1;
  options.tolerance = 0.1;
  EXPECT_EQ(solveGreen(starShape(smoothStar(3)), options).record().summary.stop, "tolerance reached");
}

TEST(GreenFunction, AToleranceBeyondReachSpendsTheBudgetAndConverges) {
  GreenOptions options;
  options.tolerance = 1e-8;
  options.growth = 1;
  options.spareVertices = 100;
  const GreenFunction green = solveGreen(starShape(smoothStar(3)), options);
  EXPECT_EQ(green.record().summary.stop, "budget spent");
  EXPECT_LE(green.record().summary.residual, 1e-6);
}

TEST(GreenFunction, SaysWhenItDoesNotConverge) {
  GreenOptions options;
  options.maxIterations = 2;
  try {
    solveGreen(starShape(smoothStar(2)), options);
    FAIL() << "two iterations cannot reach 1e-6";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::notConverged);
    EXPECT_NE(std::string(error.what()).find("residual"), std::string::npos);
  }
}

TEST(GreenFunction, StopsWhenCancelled) {
  Context context;
  context.cancel();
  EXPECT_THROW(solveGreen(starShape(icosphere(3)), {}, context), Error);
}

TEST(GreenFunction, RejectsImpossibleOptions) {
  const StarShape shape = starShape(icosphere(1));
  for (auto spoil : std::initializer_list<void (*)(GreenOptions&)>{
           [](GreenOptions& o) { o.residual = 0; }, [](GreenOptions& o) { o.maxIterations = 0; },
           [](GreenOptions& o) { o.neighbours = 0; }, [](GreenOptions& o) { o.tolerance = -1; },
           [](GreenOptions& o) { o.growth = 0.5; }, [](GreenOptions& o) { o.maxPasses = 0; },
           [](GreenOptions& o) { o.spareVertices = -1; }}) {
    GreenOptions options;
    spoil(options);
    EXPECT_THROW(solveGreen(shape, options), Error);
  }
}

TEST(GreenFunction, RealModelsKeepTheirBoundaryAndCharge) {
  POLESTAR_REQUIRE_MESHES();
  for (const char* name : {"castalia.obj", "psyche.obj", "sylvia.off", "castalia_bump_2.obj"}) {
    const GreenFunction green = solveGreen(testing::starShapeFromFile(*testing::meshFolder() / name));
    EXPECT_LE(green.boundaryError().max, 1e-3) << name;
    EXPECT_NEAR(green.charge().value(), -1, 1e-4) << name;
  }
}

}  // namespace
}  // namespace polestar
