#include "polestar/render/soccer_pattern.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <random>

namespace polestar {
namespace {

// Truncated icosahedron of edge 1: distances of its faces from the center and the radii of their inscribed
// circles.
constexpr double kPentagonDistance = 2.327438436766, kPentagonInradius = 0.688190960236;
constexpr double kHexagonDistance = 2.267283942230, kHexagonInradius = 0.866025403784;

std::vector<Vec3> randomDirections(int count) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  std::vector<Vec3> directions;
  for (int i = 0; i < count; ++i) {
    const double x = normal(generator), y = normal(generator), z = normal(generator);
    directions.push_back(Vec3(x, y, z).normalized());
  }
  return directions;
}

/// Solid angle over 4 pi of a regular polygon with edge 1 that faces the center: `n` triangles from its
/// middle.
double shareOfSphere(int n, double inradius, double distance) {
  const Vec3 middle = Vec3(0, 0, distance).normalized();
  const Vec3 a = Vec3(inradius, -0.5, distance).normalized(), b = Vec3(inradius, 0.5, distance).normalized();
  const double tangent = middle.dot(a.cross(b)) / (1 + middle.dot(a) + a.dot(b) + b.dot(middle));
  return n * 2 * std::atan(tangent) / (4 * M_PI);
}

TEST(SoccerPanel, PanelsAreThoseOfATruncatedIcosahedron) {
  const int count = 400000;
  std::array<int, 32> hits{};
  double deepestPentagon = 0, deepestHexagon = 0;
  for (const Vec3& direction : randomDirections(count)) {
    const SoccerPanel panel = soccerPanel(direction);
    ++hits[panel.index];
    double& deepest = panel.pentagon() ? deepestPentagon : deepestHexagon;
    deepest = std::max(deepest, panel.seamDistance);
  }
  const double pentagon = shareOfSphere(5, kPentagonInradius, kPentagonDistance);
  const double hexagon = shareOfSphere(6, kHexagonInradius, kHexagonDistance);
  ASSERT_NEAR(12 * pentagon + 20 * hexagon, 1, 1e-9);
  for (int i = 0; i < 32; ++i) {
    const double expected = count * (i < 12 ? pentagon : hexagon);
    EXPECT_NEAR(hits[i], expected, 5 * std::sqrt(expected)) << "panel " << i;
  }
  // In a panel's middle, the sine of the angle to its seams.
  EXPECT_NEAR(deepestPentagon, std::sin(std::atan(kPentagonInradius / kPentagonDistance)), 2e-3);
  EXPECT_NEAR(deepestHexagon, std::sin(std::atan(kHexagonInradius / kHexagonDistance)), 2e-3);
}

TEST(SoccerPanel, SeamDistanceLeadsToTheNeighbour) {
  int crossed = 0;
  for (const Vec3& direction : randomDirections(2000)) {
    const SoccerPanel panel = soccerPanel(direction);
    EXPECT_NEAR(panel.seamNormal.norm(), 1, 1e-12);
    EXPECT_NEAR(direction.dot(panel.seamNormal), panel.seamDistance, 1e-12);
    // Straight towards the seam: in the same panel just before it; beyond it in another, but for the few
    // whose foot on the great circle lies past the seam's end, which are in another panel there too.
    const double angle = std::asin(panel.seamDistance);
    const Vec3 away = (panel.seamNormal - panel.seamDistance * direction).normalized();
    auto moved = [&](double by) { return Vec3(std::cos(by) * direction - std::sin(by) * away); };
    EXPECT_EQ(soccerPanel(moved(0.99 * angle)).index, panel.index);
    crossed += soccerPanel(moved(angle + 1e-6)).index != panel.index;
  }
  EXPECT_EQ(crossed, 2000);
}

TEST(SoccerPanel, LengthDoesNotMatter) {
  const Vec3 direction(0.3, -0.5, 0.2);
  const SoccerPanel one = soccerPanel(direction), other = soccerPanel(1e-5 * direction);
  EXPECT_EQ(one.index, other.index);
  EXPECT_NEAR(one.seamDistance, other.seamDistance, 1e-12);
}

/// A palette in which every part is told from the others.
Palette plain() {
  Palette palette;
  palette.hexagon = palette.hexagonRim = palette.hexagonCore = Vec3f(1, 1, 1);
  palette.pentagon = palette.pentagonRim = palette.pentagonCore = Vec3f(0.5f, 0.5f, 0.5f);
  palette.hexagonShade = palette.pentagonShade = Vec3f(0.2f, 0.2f, 0.2f);
  palette.core = Vec3f(0, 1, 0);
  palette.pole = Vec3f(0, 0, 1);
  palette.line = Vec3f::Zero();
  return palette;
}

/// On a plane through the center of a ball whose coordinates are the ball's own.
PatternPoint onPlane(const Vec3& radial, const Vec3& tangent, double radius, double pixel) {
  PatternPoint point;
  point.ball = radius * radial;
  point.alongFirst = radial;
  point.alongSecond = tangent;
  point.pixel = pixel;
  point.lineWidth = 0.004;
  return point;
}

TEST(CutPattern, HasBandsLinesCoreAndPole) {
  const Palette palette = plain();
  // Into the middle of a panel, far from seams.
  Vec3 radial = Vec3::UnitX();
  for (const Vec3& d : randomDirections(20000)) {
    if (soccerPanel(d).seamDistance > soccerPanel(radial).seamDistance) radial = d;
  }
  const Vec3 tangent = radial.unitOrthogonal();
  auto color = [&](double radius) {
    return cutPattern(onPlane(radial, tangent, radius, 1e-4), palette).albedo;
  };
  EXPECT_TRUE(color(0.005).isApprox(palette.pole));
  EXPECT_TRUE(color(0.06).isApprox(palette.core));
  for (int k = 1; k <= 10; ++k) {
    EXPECT_NEAR(color(0.1 * k)[0], 0, 1e-5) << "iso-line at " << 0.1 * k;
    EXPECT_GT(color(0.1 * k - 0.003)[1], 0.3f) << "beside the iso-line at " << 0.1 * k;
  }
  for (int k = 1; k < 9; ++k) {
    const float here = color(0.1 * k + 0.07)[0], next = color(0.1 * (k + 1) + 0.07)[0];
    EXPECT_GT(std::abs(here - next), 0.2f) << "bands " << k << " and " << k + 1;
  }
}

TEST(CutPattern, LineCoversItsShareOfAPixel) {
  // Over one pixel-wide steps across the line, coverage must add up to the line's width, whatever the pixel's
  // size.
  const Palette palette = plain();
  Vec3 radial = Vec3::UnitX();
  for (const Vec3& d : randomDirections(20000)) {
    if (soccerPanel(d).seamDistance > soccerPanel(radial).seamDistance) radial = d;
  }
  const Vec3 tangent = radial.unitOrthogonal();
  for (const double pixel : {0.0005, 0.003, 0.01}) {
    double covered = 0;
    const double step = 2e-5;
    for (double radius = 0.68; radius < 0.72; radius += step) {
      const float value = cutPattern(onPlane(radial, tangent, radius, pixel), palette).albedo[0];
      const float bare =
          cutPattern(onPlane(radial, tangent, radius < 0.7 ? 0.685 : 0.715, pixel), palette).albedo[0];
      covered += step * (1 - value / bare);
    }
    EXPECT_NEAR(covered, 0.004, 0.0002) << "pixel " << pixel;
  }
}

TEST(CutPattern, GivesWayToItsMeanWhereItIsTooFine) {
  const Palette palette = plain();
  const Vec3 radial = Vec3(0.3, -0.8, 0.2).normalized();
  Vec3f low = Vec3f::Constant(9), high = Vec3f::Zero();
  for (double radius = 0.3; radius < 0.6; radius += 0.001) {
    const Vec3f color = cutPattern(onPlane(radial, radial.unitOrthogonal(), radius, 3), palette).albedo;
    low = low.cwiseMin(color);
    high = high.cwiseMax(color);
  }
  EXPECT_LT((high - low).maxCoeff(), 0.01f);
}

TEST(SkinPattern, HasPanelsAndGrooves) {
  const Palette palette = plain();
  int grooves = 0;
  for (const Vec3& d : randomDirections(3000)) {
    PatternPoint point;
    point.ball = d;
    point.alongFirst = d.unitOrthogonal();
    point.alongSecond = d.cross(point.alongFirst);
    point.pixel = 0.001;
    point.lineWidth = 0.006;
    const PatternValue value = skinPattern(point, palette);
    const SoccerPanel panel = soccerPanel(d);
    if (panel.seamDistance > 0.06) {
      EXPECT_TRUE(value.albedo.isApprox(panel.pentagon() ? palette.pentagon : palette.hexagon, 1e-4f));
      EXPECT_LT(std::hypot(value.slopeFirst, value.slopeSecond), 1e-3);
    } else if (panel.seamDistance < 0.005) {
      EXPECT_LT(value.albedo[0], 0.01f);
    } else if (panel.seamDistance > 0.008 && panel.seamDistance < 0.012) {
      // The groove's flank falls towards the seam.
      const Vec3 uphill = value.slopeFirst * point.alongFirst + value.slopeSecond * point.alongSecond;
      EXPECT_GT(uphill.dot(panel.seamNormal), 0.1);
      ++grooves;
    }
  }
  EXPECT_GT(grooves, 10);
}

}  // namespace
}  // namespace polestar
