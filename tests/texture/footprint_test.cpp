#include "polestar/texture/detail/footprint.h"

#include <gtest/gtest.h>

#include "polestar/texture/detail/ramp.h"
#include "support.h"

namespace polestar::detail {
namespace {

TEST(Varying, DerivativesAreThoseOfDifferences) {
  auto f = [](const VaryingPoint& p) {
    const Varying a = sqrt(p.x * p.x + 2.0) / (p.y + 3.0) - exp(-1.0 * p.z) * sin(p.x * p.y);
    return max(abs(a), 0.01) + log(hypot(p.x, p.z) + 1.0) * cos(p.y) + atan2(p.y, p.x + 2.0);
  };
  const double h = 1e-6;
  for (const Vec3& p : testing::randomPoints(200, 1, 1)) {
    const Vec3 gradient = f(VaryingPoint(p)).gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = h * Vec3::Unit(axis);
      const double difference = (f(VaryingPoint(p + step)).value - f(VaryingPoint(p - step)).value) / (2 * h);
      EXPECT_NEAR(gradient[axis], difference, 1e-6 * (1 + std::abs(difference)));
    }
  }
}

TEST(Varying, VarianceFollowsFirstOrder) {
  const Varying x(0.7, Vec3::Zero(), 1e-6), y(-1.2, Vec3::Zero(), 4e-6);
  EXPECT_NEAR((3.0 * x).variance, 9e-6, 1e-15);
  EXPECT_NEAR((x + y).variance, 5e-6, 1e-15);
  EXPECT_NEAR((x * y).variance, 1.44e-6 + 0.49 * 4e-6, 1e-15);
  EXPECT_NEAR(sin(x).variance, std::pow(std::cos(0.7), 2) * 1e-6, 1e-15);
}

TEST(Footprint, ScaledIsThatOfTheScaledDomain) {
  std::mt19937 generator(1);
  const Footprint footprint(testing::randomFootprint(0.3, generator));
  const VaryingPoint domain = 7.0 * VaryingPoint(Vec3(0.1, 0.2, 0.3));
  for (const double spread : {0.1, 1.0, 4.0}) {
    EXPECT_NEAR(footprint.scaled(7).kept(spread), footprint.in(domain).kept(spread), 1e-12);
    EXPECT_NEAR(footprint.scaled(7).kept(spread), footprint.kept(7 * spread), 1e-12);
  }
}

TEST(Footprint, KeepsAllOfWhatIsLargeAndNothingOfWhatIsSmall) {
  EXPECT_EQ(Footprint(Mat3::Zero()).kept(1e6), 1);
  double last = 1;
  for (double size = 1e-3; size < 1e3; size *= 1.5) {
    const double kept = Footprint(size * Mat3::Identity()).kept(3);
    EXPECT_LE(kept, last);
    last = kept;
  }
  EXPECT_LT(last, 1e-9);
}

TEST(Shares, OfALineAddUpToItsWidth) {
  for (const double edge : {0.001, 0.01, 0.1}) {
    const Footprint footprint(edge * Mat3::Identity());
    double covered = 0;
    const double step = 1e-4;
    for (double x = -0.5; x < 0.5; x += step) {
      covered += step * shareWithin(Varying(x, Vec3::UnitX()), 0.02, 0.01, footprint);
    }
    EXPECT_NEAR(covered, 0.04, 1e-4) << "footprint " << edge;
  }
}

TEST(Shares, OfAnEdgeAtAPointAreZeroOrOne) {
  const Footprint point(Mat3::Zero());
  EXPECT_EQ(shareAbove(Varying(1e-9, Vec3::UnitX()), 0, point), 1);
  EXPECT_EQ(shareAbove(Varying(-1e-9, Vec3::UnitX()), 0, point), 0);
  EXPECT_EQ(shareWithin(Varying(0.0, Vec3::UnitX()), 0.1, 0, point), 1);
}

TEST(Ramp, MeanIsThatOfItsPoints) {
  const Ramp ramp({{0, 0xff0000}, {0.25, 0x00ff00}, {0.25, 0x0000ff}, {1, 0xffffff}});
  for (const double width : {1e-9, 0.01, 0.3, 4.0}) {
    for (double middle = -0.5; middle < 1.5; middle += 0.13) {
      Vec3 sum = Vec3::Zero();
      constexpr int kCount = 4000;
      for (int i = 0; i < kCount; ++i) {
        sum += ramp.mean(middle + width * ((i + 0.5) / kCount - 0.5), 0).cast<double>() / kCount;
      }
      EXPECT_NEAR((ramp.mean(middle, width).cast<double>() - sum).norm(), 0, 2e-3) << middle << " " << width;
    }
  }
}

TEST(MeanCosine, IsTheMean) {
  const Footprint footprint(Mat3(Vec3(0.4, 0, 0).asDiagonal()));
  for (double x = 0; x < 6; x += 0.3) {
    const double mean = (std::sin(3 * (x + 0.2)) - std::sin(3 * (x - 0.2))) / 1.2;
    EXPECT_NEAR(meanCosine(Varying(3 * x, 3 * Vec3::UnitX()), footprint), mean, 1e-12);
  }
}

}  // namespace
}  // namespace polestar::detail
