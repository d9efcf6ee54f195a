#include "polestar/render/soccer_pattern.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "polestar/texture/soccer_panel.h"

namespace polestar {
namespace {

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
