#include "polestar/map/radius_profile.h"

#include <gtest/gtest.h>

#include <cmath>

#include "polestar/core/error.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/solids.h"

namespace polestar {
namespace {

using Knot = RadiusProfile::Knot;

const std::vector<Knot>& steepKnots() {
  static const std::vector<Knot> knots{{0.03, 0.2}, {0.2, 0.25}, {0.5, 0.26}, {0.9, 0.5}, {1, 1}};
  return knots;
}

TEST(RadiusProfile, IsTheIdentityUnlessTold) {
  const RadiusProfile radius;
  for (const double r : {0.0, 0.3, 1.0}) {
    EXPECT_EQ(radius.value(r), r);
    EXPECT_EQ(radius.inverse(r), r);
    EXPECT_EQ(radius.derivative(r), 1);
  }
  EXPECT_EQ(radius.kind(), RadiusKind::green);
}

TEST(RadiusProfile, GoesThroughItsKnots) {
  const RadiusProfile radius(RadiusKind::mixed, {{0.1, 0.15}, {0.5, 0.6}, {1, 1}});
  EXPECT_NEAR(radius.value(0.1), 0.15, 1e-15);
  EXPECT_NEAR(radius.value(0.5), 0.6, 1e-15);
  EXPECT_EQ(radius.value(1), 1);
  EXPECT_EQ(radius.value(0), 0);
}

TEST(RadiusProfile, RisesSmoothlyWhateverTheKnots) {
  const RadiusProfile radius(RadiusKind::balanced, steepKnots());
  double last = 0, lastSlope = radius.derivative(0);
  constexpr int kSteps = 20000;
  for (int i = 1; i <= kSteps; ++i) {
    const double r = static_cast<double>(i) / kSteps, s = radius.value(r), slope = radius.derivative(r);
    ASSERT_GT(s, last) << r;
    ASSERT_GT(slope, 0) << r;
    ASSERT_LT(std::abs(slope - lastSlope), 0.05) << "a kink at " << r;
    if (i < kSteps) {
      ASSERT_NEAR(slope, (radius.value(r + 1e-6) - radius.value(r - 1e-6)) / 2e-6, 1e-3);
    }
    ASSERT_NEAR(radius.inverse(s), r, 1e-9);
    last = s, lastSlope = slope;
  }
}

TEST(RadiusProfile, IsLinearAtTheCenter) {
  const RadiusProfile radius(RadiusKind::balanced, steepKnots());
  for (const double r : {1e-9, 1e-3, 0.02}) EXPECT_NEAR(radius.value(r) / r, radius.derivative(0), 1e-12);
}

TEST(RadiusProfile, IsMadeAgainFromItsKnots) {
  const RadiusProfile radius(RadiusKind::balanced, steepKnots());
  const RadiusProfile again(radius.kind(), {radius.knots().begin(), radius.knots().end()});
  for (int i = 0; i <= 100; ++i) EXPECT_EQ(radius.value(0.01 * i), again.value(0.01 * i));
}

TEST(RadiusProfile, RefusesKnotsThatDoNotRise) {
  for (const std::vector<Knot>& knots : std::vector<std::vector<Knot>>{{},
                                                                       {{1, 1}},
                                                                       {{0.5, 0.6}, {0.7, 0.6}, {1, 1}},
                                                                       {{0.5, 0.6}, {0.4, 0.7}, {1, 1}},
                                                                       {{0, 0}, {1, 1}},
                                                                       {{0.5, 0.6}, {0.9, 0.9}}}) {
    EXPECT_THROW(RadiusProfile(RadiusKind::mixed, knots), Error);
  }
}

/// Share of the solid's volume that goes into the ball of radius `s`.
double shareWithin(const BallMap& map, double s) {
  const TriMesh& mesh = map.chart().green().shape().surface().mesh();
  const Box box = boundingBox(mesh);
  std::vector<Vec3> x, y;
  for (double a = box.min[0]; a < box.max[0]; a += 0.04) {
    for (double b = box.min[1]; b < box.max[1]; b += 0.04) {
      for (double c = box.min[2]; c < box.max[2]; c += 0.04) x.emplace_back(a, b, c);
    }
  }
  y.resize(x.size());
  map.forward(x, y);
  double inside = 0, within = 0;
  for (const Vec3& p : y) {
    inside += p.allFinite();
    within += p.allFinite() && p.norm() < s;
  }
  return within / inside;
}

TEST(RadiusProfile, VolumeSharesOutTheSolid) {
  const StarShape shape =
      testing::starShape(transformed(icosphere(3), [](const Vec3& v) { return Vec3(2 * v[0], v[1], v[2]); }));
  MapOptions options;
  const BallMap green = mapToBall(shape, options);
  options.radius = RadiusKind::volume;
  const BallMap volume = mapToBall(shape, options);
  options.radius = RadiusKind::mixed;
  const BallMap mixed = mapToBall(shape, options);
  for (const double s : {0.4, 0.6, 0.8}) {
    EXPECT_NEAR(shareWithin(volume, s), s * s * s, 0.02) << s;
    // R itself crowds the ends of the spheroid against the sphere.
    EXPECT_LT(shareWithin(green, s), 0.8 * s * s * s) << s;
    const double r = mixed.radius().inverse(s);
    EXPECT_NEAR(s, 0.5 * (r + volume.radius().value(r)), 5e-3);
  }
}

TEST(RadiusProfile, OfABallChangesNothing) {
  const BallMap map = testing::ballMap(testing::starShape(icosphere(3), Vec3(0, 0, 0)));
  const RadiusProfile volume = radiusProfile(RadiusKind::volume, map.chart().foliation());
  for (const double r : {0.1, 0.3, 0.7, 0.9}) EXPECT_NEAR(volume.value(r), r, 0.01);
  EXPECT_THROW(radiusProfile(RadiusKind::balanced, map.chart().foliation()), Error);
}

}  // namespace
}  // namespace polestar
