// Curves and pieces of surface through the inverse of any map: near enough, no more points than that takes.
#include "polestar/map/domain_curves.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "polestar/core/error.h"
#include "support/formula_map.h"

namespace polestar {
namespace {

using testing::ballMap;
using testing::FormulaMap;

/// A cube of the domain, sheared by waves: no ball at all.
FormulaMap wavyCube() {
  return FormulaMap(
      [](const Vec3& x) -> Vec3 {
        return {x[0] - 0.3 * std::sin(3 * x[1]), x[1], x[2]};
      },
      [](const Vec3& y) -> Vec3 {
        if (y.cwiseAbs().maxCoeff() > 1) return testing::kNotANumber;
        return {y[0] + 0.3 * std::sin(3 * y[1]), y[1], y[2]};
      });
}

DomainCurve circle(double radius) {
  return {[=](double t) -> Vec3 {
    return radius * Vec3(std::cos(2 * std::numbers::pi * t), std::sin(2 * std::numbers::pi * t), 0);
  }};
}

/// How far the curve runs from its polyline, at many places.
double farthest(const FormulaMap& map, const DomainCurve& curve, const SolidCurve& traced) {
  double worst = 0;
  for (int i = 0; i <= 5000; ++i) {
    const Vec3 domain = curve.point(i / 5000.0);
    Vec3 x;
    map.inverse({&domain, 1}, {&x, 1});
    double least = 1e300;
    for (std::size_t k = 0; k + 1 < traced.solid.size(); ++k) {
      const Vec3 &a = traced.solid[k], &b = traced.solid[k + 1];
      const double t = std::clamp((b - a).dot(x - a) / (b - a).squaredNorm(), 0.0, 1.0);
      least = std::min(least, (x - a - t * (b - a)).norm());
    }
    worst = std::max(worst, least);
  }
  return worst;
}

TEST(DomainCurves, StraightOnesStayAsTheyBegan) {
  const FormulaMap map = ballMap(2, {1, 2, 3});
  const std::vector<DomainCurve> curves{domainPolyline({Vec3::Zero(), Vec3(0, 0, 1)})};
  const SolidCurve line = traceCurves(map, curves, {.tolerance = 1e-9})[0];
  ASSERT_EQ(line.solid.size(), static_cast<std::size_t>(curves[0].pieces) + 1);
  EXPECT_EQ(line.solid.front(), Vec3(1, 2, 3));
  EXPECT_LT((line.solid.back() - Vec3(1, 2, 5)).norm(), 1e-15);
}

TEST(DomainCurves, ChordsAreAsNearAsAsked) {
  const FormulaMap ball = ballMap(2), cube = wavyCube();
  const DomainCurve ring = circle(0.5), edge = domainPolyline({Vec3(0.5, -1, 0), Vec3(0.5, 1, 0)});
  std::size_t before = 0;
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    const SolidCurve a = traceCurves(ball, {&ring, 1}, {.tolerance = tolerance})[0];
    const SolidCurve b = traceCurves(cube, {&edge, 1}, {.tolerance = tolerance})[0];
    EXPECT_LE(farthest(ball, ring, a), 1.05 * tolerance);
    EXPECT_LE(farthest(cube, edge, b), 1.05 * tolerance);
    // A circle of radius 1 by chords: their sagitta is half the square of half their angle. At most twice as
    // many as that takes, since pieces are halved.
    EXPECT_LE(a.solid.size(), 2 * std::numbers::pi / std::sqrt(2 * tolerance) + 9);
    EXPECT_GT(a.solid.size(), before);
    before = a.solid.size();
  }
}

TEST(DomainCurves, CornersStayCorners) {
  const std::vector<Vec3> corners{{-1, -1, 0}, {0.3, -0.2, 0.1}, {0.3, 1, 1}, {-1, 1, 1}};
  const FormulaMap map = wavyCube();
  const DomainCurve curve = domainPolyline(corners);
  const SolidCurve traced = traceCurves(map, {&curve, 1}, {.tolerance = 1e-3})[0];
  for (const Vec3& corner : corners) {
    const double nearest = (*std::min_element(traced.domain.begin(), traced.domain.end(),
                                              [&](const Vec3& a, const Vec3& b) {
                                                return (a - corner).norm() < (b - corner).norm();
                                              }) -
                            corner)
                               .norm();
    EXPECT_LT(nearest, 1e-15);
  }
}

TEST(DomainCurves, DepthEndsWhatNoToleranceDoes) {
  const DomainCurve ring = circle(0.5);
  const SolidCurve traced = traceCurves(ballMap(2), {&ring, 1}, {.tolerance = 1e-30, .deepest = 3})[0];
  EXPECT_EQ(traced.solid.size(), 8u * 8 + 1);
}

TEST(DomainCurves, GridsAreRowByRow) {
  const FormulaMap map = wavyCube();
  const DomainGrid face{[](double u, double v) { return Vec3(2 * u - 1, 2 * v - 1, 1); }, 4, 2};
  const SolidCurve grid = traceGrid(map, face);
  ASSERT_EQ(grid.solid.size(), 15u);
  EXPECT_EQ(grid.domain[1], Vec3(-0.5, -1, 1));
  EXPECT_EQ(grid.domain[5], Vec3(-1, 0, 1));
  EXPECT_LT((grid.solid[14] - Vec3(1 + 0.3 * std::sin(3.0), 1, 1)).norm(), 1e-15);
}

TEST(DomainCurves, WhatIsNowhereIsAnError) {
  const FormulaMap map = ballMap();
  const DomainCurve out = domainPolyline({Vec3::Zero(), Vec3(0, 0, 1.5)});
  try {
    traceCurves(map, {&out, 1}, {.tolerance = 1e-3});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
  }
  EXPECT_THROW(traceCurves(map, {}, {.tolerance = 0}), Error);
  EXPECT_THROW(domainPolyline({Vec3::Zero()}), Error);
}

}  // namespace
}  // namespace polestar
