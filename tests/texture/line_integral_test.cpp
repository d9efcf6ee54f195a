#include "polestar/texture/line_integral.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "polestar/core/error.h"
#include "support.h"

namespace polestar {
namespace {

const LineIntegralOptions kOptions{.length = 2, .thickness = 0.05};

void straight(std::span<const Vec3> points, std::span<Vec3> directions) {
  std::fill(directions.begin(), directions.end(), Vec3(1, 2, -1));
  (void)points;
}

/// Circles about the z axis.
void circles(std::span<const Vec3> points, std::span<Vec3> directions) {
  for (std::size_t i = 0; i < points.size(); ++i) directions[i] = Vec3(-points[i][1], points[i][0], 0);
}

std::vector<float> valuesAt(const std::vector<Vec3>& points, const FiberField& field,
                            const LineIntegralOptions& options = kOptions) {
  std::vector<float> values(points.size());
  lineIntegral(points, field, options, values);
  return values;
}

double correlation(const std::vector<float>& a, const std::vector<float>& b) {
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += a[i] * b[i];
    aa += a[i] * a[i];
    bb += b[i] * b[i];
  }
  return ab / std::sqrt(aa * bb);
}

TEST(LineIntegral, ValuesAreEvenlySpreadAroundZero) {
  const auto values = valuesAt(testing::randomPoints(4000, 50, 1), straight);
  double sum = 0, squares = 0;
  for (const float value : values) {
    ASSERT_LE(std::abs(value), 1);
    sum += value;
    squares += value * value;
  }
  EXPECT_NEAR(sum / 4000, 0, 0.04);
  // Uniform in [-1, 1] has variance 1/3.
  EXPECT_NEAR(squares / 4000, 1.0 / 3, 0.03);
}

TEST(LineIntegral, StreaksRunAlongStraightLines) {
  const auto points = testing::randomPoints(3000, 20, 2);
  const Vec3 along = Vec3(1, 2, -1).normalized(), across = along.unitOrthogonal();
  auto moved = points, aside = points;
  for (Vec3& p : moved) p += 0.5 * along;
  for (Vec3& p : aside) p += 2 * kOptions.thickness * across;
  const auto values = valuesAt(points, straight);
  EXPECT_GT(correlation(values, valuesAt(moved, straight)), 0.6);
  EXPECT_LT(std::abs(correlation(values, valuesAt(aside, straight))), 0.15);
}

TEST(LineIntegral, StreaksRunAlongCurves) {
  // Around the axis by an arc of 0.5, over which a straight streak would be off by two and a half
  // thicknesses.
  std::vector<Vec3> points, moved, aside;
  for (const Vec3& p : testing::randomPoints(6000, 3, 3)) {
    const double radius = std::hypot(p[0], p[1]);
    if (radius < 0.8 || radius > 1.2) continue;
    const Mat3 turn = Eigen::AngleAxisd(0.5 / radius, Vec3::UnitZ()).toRotationMatrix();
    points.push_back(p);
    moved.push_back(turn * p);
    aside.push_back(p + 2 * kOptions.thickness * Vec3(p[0], p[1], 0) / radius);
  }
  ASSERT_GT(points.size(), 400u);
  const auto values = valuesAt(points, circles);
  EXPECT_GT(correlation(values, valuesAt(moved, circles)), 0.6);
  EXPECT_LT(std::abs(correlation(values, valuesAt(aside, circles))), 0.2);
}

TEST(LineIntegral, SignAndLengthOfTheFieldDoNotMatter) {
  // A sign that changes from place to place, as eigenvectors have.
  const FiberField flipped = [](std::span<const Vec3> points, std::span<Vec3> directions) {
    circles(points, directions);
    for (std::size_t i = 0; i < points.size(); ++i)
      directions[i] *= std::sin(40 * points[i][0]) < 0 ? -0.1 : 30;
  };
  std::vector<Vec3> points;
  for (const Vec3& p : testing::randomPoints(300, 2, 4)) {
    if (std::hypot(p[0], p[1]) > 0.3) points.push_back(p);
  }
  const auto one = valuesAt(points, circles), other = valuesAt(points, flipped);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(one[i], other[i], 1e-4);
}

TEST(LineIntegral, LinesEndWithTheField) {
  // A field of a ball, NaN and zero outside: values there and beside it are finite and as widely spread.
  const FiberField ball = [](std::span<const Vec3> points, std::span<Vec3> directions) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool inside = points[i].norm() < 1;
      directions[i] = inside
                          ? Vec3(0, 0, 1)
                          : Vec3::Constant(points[i][0] > 0 ? 0 : std::numeric_limits<double>::quiet_NaN());
    }
  };
  double squares = 0;
  const auto points = testing::randomPoints(4000, 1.2, 5);
  for (const float value : valuesAt(points, ball)) {
    ASSERT_TRUE(std::isfinite(value));
    squares += value * value / 4000.0;
  }
  EXPECT_NEAR(squares, 1.0 / 3, 0.06);
}

TEST(LineIntegral, IsTheSameInAnyBatch) {
  const auto points = testing::randomPoints(3000, 2, 6);
  const auto all = valuesAt(points, circles);
  for (const std::size_t i : {0u, 1023u, 1024u, 2999u}) EXPECT_EQ(valuesAt({points[i]}, circles)[0], all[i]);
}

TEST(LineIntegral, ContrastDrivesValuesToTheEnds) {
  LineIntegralOptions options = kOptions;
  options.contrast = 4;
  const auto values = valuesAt(testing::randomPoints(2000, 50, 7), straight, options);
  const double size = std::accumulate(values.begin(), values.end(), 0.0,
                                      [](double sum, float value) { return sum + std::abs(value); });
  EXPECT_GT(size / 2000, 0.8);
}

TEST(LineIntegral, OptionsAreChecked) {
  for (const LineIntegralOptions& wrong :
       {LineIntegralOptions{.length = 0, .thickness = 1}, LineIntegralOptions{.length = 1, .thickness = -1},
        LineIntegralOptions{.length = 1, .thickness = 1, .contrast = 0},
        LineIntegralOptions{.length = 1e9, .thickness = 1}}) {
    EXPECT_THROW(wrong.validate(), Error);
  }
  EXPECT_NO_THROW(kOptions.validate());
}

}  // namespace
}  // namespace polestar
