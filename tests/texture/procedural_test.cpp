#include "polestar/texture/procedural.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <string>

#include "polestar/core/error.h"
#include "support.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;

std::string refusal(std::string_view name, const TextureSettings& settings = {}) {
  try {
    makeTexture(name, settings);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::usage);
    return error.what();
  }
  return "";
}

TEST(Procedural, UnknownNamesAreRefusedWithWhatThereIs) {
  EXPECT_THAT(refusal("kiwii"), HasSubstr("did you mean 'kiwi'?"));
  EXPECT_THAT(refusal("treerings"), HasSubstr("did you mean 'tree-rings'?"));
  EXPECT_THAT(refusal(""), HasSubstr("watermelon"));
  EXPECT_THAT(refusal("chocolate"), HasSubstr("agate, granite, kiwi"));
  EXPECT_THAT(refusal("chocolate"), Not(HasSubstr("did you mean")));
  EXPECT_THAT(refusal("kiwi", {{"seed", 2}, {"locule", 3}}), HasSubstr("did you mean 'locules'?"));
}

TEST(Procedural, ValuesOutOfRangeAreRefused) {
  EXPECT_THAT(refusal("orange", {{"segments", 1000}}),
              HasSubstr("'segments' of orange has to be from 5 to 16"));
  EXPECT_THAT(refusal("orange", {{"segments", std::numeric_limits<double>::quiet_NaN()}}),
              HasSubstr("segments"));
  EXPECT_EQ(refusal("orange", {{"segments", 12}}), "");
}

TEST(Procedural, NamesAndRangesAreInOrder) {
  std::set<std::string_view> names;
  for (const TextureInfo& info : proceduralTextures()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_FALSE(info.description.empty());
    std::set<std::string_view> parameters;
    for (const TextureParameter& p : info.parameters) {
      EXPECT_TRUE(parameters.insert(p.name).second) << info.name << " " << p.name;
      EXPECT_LE(p.min, p.defaultValue) << info.name << " " << p.name;
      EXPECT_LE(p.defaultValue, p.max) << info.name << " " << p.name;
      EXPECT_EQ(p.description.find('\n'), std::string_view::npos);
    }
    EXPECT_EQ(parameters.contains("seed"), info.name != "soccer") << info.name;
  }
  EXPECT_EQ(names.size(), 8u);
}

/// Colors, gloss and slopes at points all over the ball and on its skin.
std::vector<TextureSample> everywhere(const SolidTexture& texture, const Mat3& footprint) {
  std::vector<TexturePoint> points;
  for (const Vec3& p : testing::randomBallPoints(3000, 1)) points.push_back({p, footprint});
  for (const Vec3& d : testing::randomDirections(1500, 2)) points.push_back({(1 + 1e-6) * d, footprint});
  // The axes and the places where coordinates have no derivative.
  for (const double r : {0.0, 1e-300, 1e-12, 1e-5, 0.3, 1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      points.push_back({r * Vec3::Unit(axis), footprint});
      points.push_back({-r * Vec3::Unit(axis), footprint});
    }
  }
  std::vector<TextureSample> samples(points.size());
  texture.sample(points, samples);
  return samples;
}

class EveryTexture : public ::testing::TestWithParam<std::string_view> {};

TEST_P(EveryTexture, IsFiniteAndAColorForEveryFootprint) {
  const auto texture = makeTexture(GetParam());
  std::mt19937 generator(1);
  for (const double size : {0.0, 1e-12, 1e-3, 0.1, 1.0, 1e4, 1e30}) {
    for (const Mat3& footprint : {Mat3(size * Mat3::Identity()), testing::randomFootprint(size, generator),
                                  Mat3(Vec3(size, 0, 0).asDiagonal())}) {
      for (const TextureSample& sample : everywhere(*texture, footprint)) {
        ASSERT_TRUE(sample.color.allFinite()) << "footprint " << size;
        ASSERT_GE(sample.color.minCoeff(), 0) << "footprint " << size;
        ASSERT_LE(sample.color.maxCoeff(), 1) << "footprint " << size;
        ASSERT_GE(sample.gloss, 0);
        ASSERT_LE(sample.gloss, 1);
        ASSERT_TRUE(sample.heightGradient.allFinite());
      }
    }
  }
}

TEST_P(EveryTexture, IsFiniteAtTheEndsOfItsParameters) {
  for (const TextureInfo& info : proceduralTextures()) {
    if (info.name != GetParam()) continue;
    for (const TextureParameter& p : info.parameters) {
      for (const double value : {p.min, p.max}) {
        const auto texture = makeTexture(info.name, {{std::string(p.name), value}});
        for (const TextureSample& sample : everywhere(*texture, 0.01 * Mat3::Identity())) {
          ASSERT_TRUE(sample.color.allFinite() && sample.heightGradient.allFinite())
              << p.name << " " << value;
          ASSERT_GE(sample.color.minCoeff(), 0) << p.name << " " << value;
          ASSERT_LE(sample.color.maxCoeff(), 1) << p.name << " " << value;
        }
      }
    }
  }
}

TEST_P(EveryTexture, HasParametersThatAllMatter) {
  for (const TextureInfo& info : proceduralTextures()) {
    if (info.name != GetParam()) continue;
    const auto plain = everywhere(*makeTexture(info.name), Mat3::Zero());
    for (const TextureParameter& p : info.parameters) {
      const double value = p.defaultValue + 0.4 * (std::min(p.max, 100.0) - p.defaultValue);
      const auto changed = everywhere(
          *makeTexture(info.name, {{std::string(p.name), value != p.defaultValue ? value : p.min}}),
          Mat3::Zero());
      double difference = 0;
      for (std::size_t i = 0; i < plain.size(); ++i) {
        difference += (plain[i].color - changed[i].color).norm() +
                      std::abs(plain[i].gloss - changed[i].gloss) +
                      (plain[i].heightGradient - changed[i].heightGradient).norm();
      }
      EXPECT_GT(difference, 0.05) << p.name;
    }
  }
}

TEST_P(EveryTexture, IsTheSameInAnyBatch) {
  const auto texture = makeTexture(GetParam()), again = makeTexture(GetParam());
  std::vector<TexturePoint> points;
  for (const Vec3& p : testing::randomBallPoints(200, 3)) points.push_back({p, 0.01 * Mat3::Identity()});
  std::vector<TextureSample> samples(points.size());
  texture->sample(points, samples);
  for (std::size_t i = points.size(); i-- > 0;) {
    EXPECT_EQ(testing::colorAt(*again, points[i].ball, points[i].footprint), samples[i].color);
  }
}

TEST_P(EveryTexture, FiberIsADirectionWhereThereIsOne) {
  const auto texture = makeTexture(GetParam());
  const auto points = testing::randomBallPoints(500, 4);
  std::vector<Vec3> fiber(points.size());
  texture->fiber(points, fiber);
  for (const Vec3& f : fiber) {
    ASSERT_TRUE(f.allFinite());
    EXPECT_EQ(f.norm() > 0, texture->hasFiber());
  }
  const Vec3 center = Vec3::Zero();
  texture->fiber({&center, 1}, {fiber.data(), 1});
  EXPECT_TRUE(fiber[0].allFinite());
}

INSTANTIATE_TEST_SUITE_P(All, EveryTexture, ::testing::ValuesIn(testing::textureNames()),
                         testing::nameOfTest);

}  // namespace
}  // namespace polestar
