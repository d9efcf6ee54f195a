#include "polestar/texture/detail/noise.h"

#include <gtest/gtest.h>

#include "support.h"

namespace polestar::detail {
namespace {

using testing::randomDirections;
using testing::randomPoints;

TEST(SimplexNoise, HasMeanZeroVarianceOneAndBounds) {
  double sum = 0, squares = 0, largest = 0;
  const auto points = randomPoints(400000, 500, 1);
  for (const Vec3& p : points) {
    const double value = simplexNoise(p, 3).value;
    sum += value;
    squares += value * value;
    largest = std::max(largest, std::abs(value));
  }
  const double count = static_cast<double>(points.size());
  EXPECT_NEAR(sum / count, 0, 5 / std::sqrt(count));
  EXPECT_NEAR(squares / count, 1, 0.01);
  EXPECT_LT(largest, 6);
}

TEST(SimplexNoise, GradientIsThatOfDifferences) {
  // The sums are floats: differences over 1/64 have errors of their second order, about 1e-3, at the most.
  const double h = 1.0 / 64;
  double error = 0, size = 0;
  for (const Vec3& p : randomPoints(2000, 20, 2)) {
    const Vec3 gradient = simplexNoise(p, 5).gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = h * Vec3::Unit(axis);
      const double difference =
          (8 * (simplexNoise(p + step, 5).value - simplexNoise(p - step, 5).value) -
           (simplexNoise(p + 2 * step, 5).value - simplexNoise(p - 2 * step, 5).value)) /
          (12 * h);
      error = std::max(error, std::abs(difference - gradient[axis]));
      size = std::max(size, std::abs(gradient[axis]));
    }
  }
  EXPECT_GT(size, 5);
  EXPECT_LT(error, 0.02);
}

TEST(SimplexNoise, IsContinuousAcrossCells) {
  // Along lines, in steps that no smooth function of this size could jump over.
  for (const Vec3& d : randomDirections(20, 3)) {
    double last = simplexNoise(Vec3::Zero(), 9).value;
    for (int i = 1; i < 20000; ++i) {
      const double value = simplexNoise(i * 1e-3 * d, 9).value;
      ASSERT_LT(std::abs(value - last), 0.025) << "step " << i;
      last = value;
    }
  }
}

TEST(SimplexNoise, IsTheSameOnEveryMachine) {
  // Golden values: a change of these changes every picture.
  EXPECT_NEAR(simplexNoise(Vec3(0.3, -1.7, 2.2), 1).value, 0.136658847, 1e-5);
  EXPECT_NEAR(simplexNoise(Vec3(-101.25, 33.5, 0.125), 77).value, -0.484185636, 1e-5);
  EXPECT_NE(simplexNoise(Vec3(0.3, -1.7, 2.2), 1).value, simplexNoise(Vec3(0.3, -1.7, 2.2), 2).value);
}

TEST(SimplexNoise, IsIsotropic) {
  // Mean squares of derivatives along the axes and along diagonals.
  const auto directions = randomDirections(8, 4);
  std::vector<double> squares(directions.size(), 0.0);
  for (const Vec3& p : randomPoints(100000, 300, 5)) {
    const Vec3 gradient = simplexNoise(p, 1).gradient;
    for (std::size_t i = 0; i < directions.size(); ++i)
      squares[i] += std::pow(gradient.dot(directions[i]), 2);
  }
  const auto [least, most] = std::minmax_element(squares.begin(), squares.end());
  EXPECT_LT(*most / *least, 1.05);
}

/// Regression of the mean over a footprint on what filtered noise says it is, and the residual's size.
TEST(FilteredNoise, IsTheMeanOverTheFootprint) {
  for (const double size : {0.2, 0.6, 1.2, 3.0}) {
    for (const Vec3& shape : {Vec3(1, 1, 1), Vec3(1, 1, 0), Vec3(1, 0, 0)}) {
      const Mat3 edges = size * Mat3(shape.asDiagonal());
      const Footprint footprint(edges);
      double product = 0, filteredSquares = 0, residual = 0;
      const auto points = randomPoints(1500, 100, 6);
      const auto offsets = randomPoints(256, 0.5, 7);
      for (const Vec3& p : points) {
        double mean = 0;
        for (const Vec3& offset : offsets) mean += simplexNoise(p + edges * offset, 1).value / 256;
        const double filtered = noise(VaryingPoint(p), footprint, 1).value;
        product += mean * filtered / 1500;
        filteredSquares += filtered * filtered / 1500;
        residual += (mean - filtered) * (mean - filtered) / 1500;
      }
      // What is right on average: with a factor of its own it would fit no better. (Nothing left: nothing to
      // fit.)
      if (filteredSquares > 0.15) {
        EXPECT_NEAR(product / filteredSquares, 1, 0.12) << size << " " << shape.transpose();
      }
      EXPECT_LT(residual, 0.27) << size << " " << shape.transpose();
    }
  }
}

TEST(FilteredNoise, TellsTheVarianceThatItLost) {
  // Spread of the values in the footprint, as the edges of a pattern are filtered by.
  for (const double size : {0.1, 0.5, 1.0, 3.0}) {
    const Mat3 edges = size * Mat3::Identity();
    const Footprint footprint(edges);
    double expected = 0, told = 0;
    const auto offsets = randomPoints(256, 0.5, 8);
    for (const Vec3& p : randomPoints(800, 100, 9)) {
      double sum = 0, squares = 0;
      for (const Vec3& offset : offsets) {
        const double value = simplexNoise(p + edges * offset, 1).value;
        sum += value / 256;
        squares += value * value / 256;
      }
      expected += squares - sum * sum;
      told += std::pow(footprint.width(noise(VaryingPoint(p), footprint, 1)), 2) / 12;
    }
    EXPECT_NEAR(told / expected, 1, 0.3) << "size " << size;
  }
}

TEST(FractalNoise, HasVarianceOneAndFadesOctaveByOctave) {
  const Octaves octaves{2, 5, 0.6};
  double squares = 0;
  for (const Vec3& p : randomPoints(50000, 100, 10)) {
    squares += std::pow(fractalNoise(VaryingPoint(p), Footprint(Mat3::Zero()), octaves, 1).value, 2);
  }
  EXPECT_NEAR(squares / 50000, 1, 0.03);
  const Varying gone =
      fractalNoise(VaryingPoint(Vec3(1, 2, 3)), Footprint(100 * Mat3::Identity()), octaves, 1);
  EXPECT_NEAR(gone.value, 0, 1e-3);
  EXPECT_NEAR(gone.variance, 1, 1e-3);
}

}  // namespace
}  // namespace polestar::detail
