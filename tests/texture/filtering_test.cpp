// The oracle of filtering: a sample with a footprint is the mean of point samples in it.

#include <gtest/gtest.h>

#include <string>

#include "polestar/texture/procedural.h"
#include "support.h"

namespace polestar {
namespace {

struct Deviation {
  double mean = 0;        ///< of the absolute difference of a channel, over points and channels
  double bias = 0;        ///< of the difference
  double unfiltered = 0;  ///< what a point sample in the middle would have
};

Deviation deviation(const SolidTexture& texture, double size, const std::vector<Vec3>& middles) {
  std::mt19937 generator(5);
  Deviation result;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const TexturePoint point{middles[i], testing::randomFootprint(size, generator)};
    const Vec3f mean = testing::supersample(texture, point, 600, static_cast<unsigned>(i));
    const Vec3f filtered = testing::colorAt(texture, point.ball, point.footprint);
    const Vec3f single = testing::colorAt(texture, point.ball);
    const double count = 3.0 * static_cast<double>(middles.size());
    result.mean += (filtered - mean).cwiseAbs().sum() / count;
    result.bias += (filtered - mean).sum() / count;
    result.unfiltered += (single - mean).cwiseAbs().sum() / count;
  }
  return result;
}

class Filtering : public ::testing::TestWithParam<std::string_view> {};

TEST_P(Filtering, IsTheMeanOverTheFootprint) {
  const auto texture = makeTexture(GetParam());
  std::vector<Vec3> middles;
  for (const Vec3& p : testing::randomBallPoints(250, 11)) middles.push_back(0.95 * p);
  for (const double size : {0.003, 0.01, 0.03, 0.1}) {
    const Deviation d = deviation(*texture, size, middles);
    // Colors are linear: white is 1. 600 random samples have an error of their own, up to 0.01 for grains. A
    // footprint of 0.1 holds a few seeds, grains or vesicles, of which their mean color knows nothing.
    EXPECT_LT(d.mean, size < 0.1 ? 0.02 : 0.03) << "footprint " << size;
    EXPECT_LT(std::abs(d.bias), size < 0.1 ? 0.008 : 0.013) << "footprint " << size;
    if (d.unfiltered > 0.02) {
      EXPECT_LT(d.mean, 0.7 * d.unfiltered) << "footprint " << size;
    }
    RecordProperty("error_" + std::to_string(size), std::to_string(d.mean));
  }
}

TEST_P(Filtering, IsTheMeanAroundTheCenter) {
  const auto texture = makeTexture(GetParam());
  std::vector<Vec3> middles;
  for (const Vec3& p : testing::randomBallPoints(120, 12)) middles.push_back(0.05 * p);
  for (const double size : {0.003, 0.02, 0.1}) {
    EXPECT_LT(deviation(*texture, size, middles).mean, size < 0.1 ? 0.03 : 0.045) << "footprint " << size;
  }
}

/// Moving by a small share of the footprint changes little, across the center too: no pinching.
TEST_P(Filtering, IsContinuousAtTheCenter) {
  const auto texture = makeTexture(GetParam());
  for (const double size : {0.01, 0.05}) {
    const Mat3 footprint = size * Mat3::Identity();
    for (const Vec3& direction : testing::randomDirections(40, 13)) {
      Vec3f last = testing::colorAt(*texture, -size * direction, footprint);
      for (int i = -19; i <= 20; ++i) {
        const Vec3f color = testing::colorAt(*texture, i / 20.0 * size * direction, footprint);
        // A twentieth of the footprint holds a twentieth of its content; where four grains meet more may
        // change, for a footprint is divided among three.
        ASSERT_LT((color - last).cwiseAbs().maxCoeff(), 0.15f) << size << " at step " << i;
        last = color;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Filtering, ::testing::ValuesIn(testing::textureNames()), testing::nameOfTest);

}  // namespace
}  // namespace polestar
