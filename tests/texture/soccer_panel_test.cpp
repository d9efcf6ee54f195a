#include "polestar/texture/soccer_panel.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "polestar/texture/procedural.h"
#include "support.h"

namespace polestar {
namespace {

using testing::randomDirections;

// Truncated icosahedron of edge 1: distances of its faces from the center and the radii of their inscribed
// circles.
constexpr double kPentagonDistance = 2.327438436766, kPentagonInradius = 0.688190960236;
constexpr double kHexagonDistance = 2.267283942230, kHexagonInradius = 0.866025403784;

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
  for (const Vec3& direction : randomDirections(count, 7)) {
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
  int crossed = 0, named = 0;
  for (const Vec3& direction : randomDirections(2000, 7)) {
    const SoccerPanel panel = soccerPanel(direction);
    EXPECT_NEAR(panel.seamNormal.norm(), 1, 1e-12);
    EXPECT_NEAR(direction.dot(panel.seamNormal), panel.seamDistance, 1e-12);
    // Straight towards the seam: in the same panel just before it; beyond it in another, but for the few
    // whose foot on the great circle lies past the seam's end, which are in another panel there too.
    const double angle = std::asin(panel.seamDistance);
    const Vec3 away = (panel.seamNormal - panel.seamDistance * direction).normalized();
    auto moved = [&](double by) { return Vec3(std::cos(by) * direction - std::sin(by) * away); };
    EXPECT_EQ(soccerPanel(moved(0.99 * angle)).index, panel.index);
    const int beyond = soccerPanel(moved(angle + 1e-6)).index;
    crossed += beyond != panel.index;
    named += beyond == panel.neighbour;
  }
  EXPECT_EQ(crossed, 2000);
  EXPECT_GT(named, 1950);
}

TEST(SoccerPanel, LengthDoesNotMatter) {
  const Vec3 direction(0.3, -0.5, 0.2);
  const SoccerPanel one = soccerPanel(direction), other = soccerPanel(1e-5 * direction);
  EXPECT_EQ(one.index, other.index);
  EXPECT_NEAR(one.seamDistance, other.seamDistance, 1e-12);
}

TEST(SoccerPanel, NeighboursAreThoseOfASoccerBall) {
  // No two pentagons meet.
  for (const Vec3& direction : randomDirections(5000, 8)) {
    const SoccerPanel panel = soccerPanel(direction);
    EXPECT_FALSE(panel.pentagon() && SoccerPanel::isPentagon(panel.neighbour));
  }
}

/// The texture has no noise: its colors between lines are exact.
TEST(Soccer, HasPanelsTimesBands) {
  const auto texture = makeTexture("soccer");
  int compared = 0;
  for (const Vec3& direction : randomDirections(400, 9)) {
    const SoccerPanel panel = soccerPanel(direction);
    if (panel.seamDistance < 0.1) continue;
    ++compared;
    // The middle of the panel has the same color as this place, in every band.
    for (int band = 1; band < 10; ++band) {
      const double radius = 0.1 * band + 0.05;
      const Vec3f here = testing::colorAt(*texture, radius * direction);
      EXPECT_TRUE(here.isApprox(testing::colorAt(*texture, (radius + 0.02) * direction), 1e-4f));
      EXPECT_FALSE(here.isApprox(testing::colorAt(*texture, (radius - 0.1) * direction), 0.02f));
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(Soccer, GroovesFallTowardsTheSeam) {
  const auto texture = makeTexture("soccer");
  int grooves = 0;
  for (const Vec3& direction : randomDirections(3000, 10)) {
    const SoccerPanel panel = soccerPanel(direction);
    const TexturePoint point{direction, Mat3::Zero()};
    TextureSample sample;
    texture->sample({&point, 1}, {&sample, 1});
    if (panel.seamDistance > 0.08) {
      EXPECT_LT(sample.heightGradient.norm(), 1e-3);
    }
    if (panel.seamDistance > 0.008 && panel.seamDistance < 0.016) {
      EXPECT_GT(sample.heightGradient.dot(panel.seamNormal), 0.1);
      ++grooves;
    }
  }
  EXPECT_GT(grooves, 10);
}

}  // namespace
}  // namespace polestar
