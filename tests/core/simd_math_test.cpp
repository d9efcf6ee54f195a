#include "polestar/core/detail/simd_math.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace polestar::detail {
namespace {

// In units in the last place of the true value.
double error(double value, long double truth) {
  const double rounded = static_cast<double>(truth);
  const double unit =
      std::nextafter(std::abs(rounded), std::numeric_limits<double>::infinity()) - std::abs(rounded);
  return static_cast<double>(std::abs(value - truth) / unit);
}

TEST(SimdMath, InverseRootIsTheInverseSquareRoot) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-900, 900);
  for (int i = 0; i < 200000; ++i) {
    const double a = std::exp2(exponent(random));
    EXPECT_LE(error(inverseRoot(a), 1 / std::sqrt(static_cast<long double>(a))), 2) << a;
  }
  EXPECT_TRUE(std::isfinite(inverseRoot(0)));
}

TEST(SimdMath, LanesOfInverseRootsAreThoseOfNumbers) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> exponent(-900, 900);
  for (int i = 0; i < 1000; ++i) {
    const double a = std::exp2(exponent(random)), b = std::exp2(exponent(random));
    Lanes<2> both{a, b};
    invertRoots(both);
    EXPECT_LE(error(both[0], 1 / std::sqrt(static_cast<long double>(a))), 2) << a;
    EXPECT_LE(error(both[1], 1 / std::sqrt(static_cast<long double>(b))), 2) << b;
  }
}

TEST(SimdMath, LogOfRatioIsTheLogarithm) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(0, 300), mantissa(1, 2);
  for (int i = 0; i < 200000; ++i) {
    // Ratios near 1, moderate and huge, between numbers of any size.
    const double b = std::ldexp(mantissa(random), static_cast<int>(exponent(random)) - 200);
    const double ratio = i % 2 ? mantissa(random) : std::exp2(exponent(random));
    const double a = b * ratio;
    if (a <= b) continue;
    const long double truth =
        std::log1p((static_cast<long double>(a) - b) / b);  // log(a / b) loses digits near 1
    EXPECT_LE(error(logOfRatio(a, b), truth), 4) << a << " / " << b;
  }
}

TEST(SimdMath, LogOfRatiosCloseToOneKeepsItsDigits) {
  for (double distance = 1e-15; distance < 0.5; distance *= 1.7) {
    const double a = 3 * (1 + distance), b = 3;
    EXPECT_LE(error(logOfRatio(a, b), std::log1p((static_cast<long double>(a) - b) / b)), 4) << distance;
  }
  EXPECT_EQ(logOfRatio(0.7, 0.7), 0);
}

TEST(SimdMath, UpperHalfAngleIsTheArcTangent) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> exponent(-40, 40), angle(0, std::numbers::pi);
  for (int i = 0; i < 200000; ++i) {
    const double scale = std::exp2(exponent(random));
    double y = std::exp2(exponent(random)), x = (i % 3 ? -1 : 1) * scale;
    if (i % 2) {
      const double a = angle(random);
      y = scale * std::sin(a);
      x = scale * std::cos(a);
    }
    const long double truth = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
    EXPECT_LE(error(upperHalfAngle(y, x), truth), 4) << y << ", " << x;
  }
}

TEST(SimdMath, UpperHalfAngleOnTheAxes) {
  EXPECT_EQ(upperHalfAngle(0, 2), 0);
  EXPECT_EQ(upperHalfAngle(0, -2), std::numbers::pi);
  EXPECT_EQ(upperHalfAngle(2, 0), std::numbers::pi / 2);
  EXPECT_TRUE(std::isfinite(upperHalfAngle(0, 0)));
}

}  // namespace
}  // namespace polestar::detail
