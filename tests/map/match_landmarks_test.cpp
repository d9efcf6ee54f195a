// Landmarks that no Moebius motion meets: met all the same, one to one, without spikes; and where they cannot
// be met, said.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include "polestar/core/error.h"
#include "polestar/map/landmarks.h"
#include "polestar/map/shell_map.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kDegree = std::numbers::pi / 180;

Vec3 randomDirection(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Vec3(normal(random), normal(random), normal(random)).normalized();
}

/// Well apart, each moved by up to `angle`, with neighbours that know nothing of each other.
std::vector<LandmarkPair> scattered(std::size_t count, double apart, double angle, unsigned seed = 3) {
  std::mt19937_64 random(seed);
  std::vector<LandmarkPair> pairs;
  while (pairs.size() < count) {
    const Vec3 from = randomDirection(random);
    const Vec3 to = Eigen::AngleAxisd(angle, randomDirection(random)) * from;
    bool free = true;
    for (const LandmarkPair& pair : pairs) {
      free = free && (pair.from - from).norm() > apart && (pair.to - to).norm() > apart;
    }
    if (free) pairs.push_back({from, to});
  }
  return pairs;
}

void expectOneToOne(const LandmarkMatch& match, double innermost = 0.01) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(innermost, 1);
  std::vector<Vec3> points(5000), there(5000), back(5000);
  for (Vec3& x : points) x = uniform(random) * randomDirection(random);
  std::vector<Mat3> jacobians(points.size());
  match.motion->forward(points, there);
  match.motion->inverse(there, back);
  match.motion->jacobian(points, jacobians);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LT((back[i] - points[i]).norm(), 1e-9);
    ASSERT_GT(jacobians[i].determinant(), 0);
  }
}

TEST(MatchLandmarks, ABallMotionWhereThatSuffices) {
  const BallMotion motion(Eigen::AngleAxisd(1.3, Vec3(1, 1, 0.3).normalized()).toRotationMatrix());
  std::vector<LandmarkPair> pairs;
  for (const LandmarkPair& pair : scattered(10, 0.2, 0.1))
    pairs.push_back({pair.from, motion.ofDirection(pair.from)});
  const LandmarkMatch match = matchLandmarks(pairs);
  EXPECT_FALSE(match.refined);
  EXPECT_NE(dynamic_cast<const BallMotion*>(match.motion.get()), nullptr);
  EXPECT_LT((match.rotation - motion.rotation()).norm(), 1e-3);
}

TEST(MatchLandmarks, MeetsWhatAHomeomorphismCan) {
  for (const auto& [count, apart, angle, dilatation] :
       {std::tuple{4u, 0.8, 20 * kDegree, 1.5}, std::tuple{12u, 0.5, 12 * kDegree, 2.0},
        std::tuple{50u, 0.25, 5 * kDegree, 3.0}, std::tuple{200u, 0.12, 2 * kDegree, 3.0}}) {
    SCOPED_TRACE(count);
    const LandmarkMatch match = matchLandmarks(scattered(count, apart, angle));
    EXPECT_TRUE(match.refined);
    EXPECT_LT(match.worst, 0.1 * kDegree);
    EXPECT_THAT(match.stalled, IsEmpty());
    EXPECT_LT(match.largestDilatation, dilatation);
    expectOneToOne(match);
  }
}

/// Two places that turn about each other by `degrees`, others that hold still.
std::vector<LandmarkPair> turnedAround(double degrees) {
  std::vector<LandmarkPair> pairs;
  for (const Vec3& u : {Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)})
    pairs.push_back({u, u});
  for (const double side : {1.0, -1.0}) {
    const Vec3 place = Vec3(0.25 * side, 0, 1).normalized();
    pairs.push_back({place, Eigen::AngleAxisd(degrees * kDegree, Vec3::UnitZ()) * place});
  }
  return pairs;
}

TEST(MatchLandmarks, GoesRoundWherePlacesTurnAboutEachOther) {
  for (const auto& [degrees, dilatation] :
       {std::pair{60.0, 3.0}, std::pair{110.0, 6.0}, std::pair{150.0, 10.0}}) {
    SCOPED_TRACE(degrees);
    const LandmarkMatch match = matchLandmarks(turnedAround(degrees));
    expectOneToOne(match);
    EXPECT_LT(match.worst, 0.1 * kDegree);
    EXPECT_THAT(match.stalled, IsEmpty());
    EXPECT_LT(match.largestDilatation, dilatation);
  }
}

// There is no straight way back to a rotation from half a turn: the core ends the flow shortly before.
TEST(MatchLandmarks, HalfATurnIsMoreThanTheCoreUndoes) {
  const LandmarkMatch match = matchLandmarks(turnedAround(180));
  expectOneToOne(match);
  EXPECT_THAT(match.stalled, HasSubstr("core"));
  EXPECT_LT(match.worst, 5 * kDegree);
}

TEST(MatchLandmarks, SaysWhatCannotBeMetAndStaysOneToOne) {
  // Three places within one edge of the table, whose middle one changes sides.
  std::vector<LandmarkPair> pairs = turnedAround(0);
  for (const double x : {0.0, 0.012, 0.024}) {
    const Vec3 from = Vec3(1, 1 + x, 0).normalized(),
               to = Vec3(1, 1 + (x == 0.012 ? 0.1 : x), 0).normalized();
    pairs.push_back({from, to});
  }
  const LandmarkMatch match = matchLandmarks(pairs);
  EXPECT_THAT(match.stalled, HasSubstr("pair "));
  EXPECT_GT(match.worst, 1e-3);
  EXPECT_EQ(match.angles.size(), pairs.size());
  expectOneToOne(match);
}

TEST(MatchLandmarks, TurnsWithItsPairs) {
  const Mat3 before = Eigen::AngleAxisd(0.7, Vec3(0, 1, 2).normalized()).toRotationMatrix(),
             after = Eigen::AngleAxisd(2.1, Vec3(3, 1, 0).normalized()).toRotationMatrix();
  const std::vector<LandmarkPair> pairs = scattered(12, 0.5, 12 * kDegree);
  std::vector<LandmarkPair> turned;
  for (const LandmarkPair& pair : pairs) turned.push_back({before * pair.from, after * pair.to});
  const LandmarkMatch first = matchLandmarks(pairs), second = matchLandmarks(turned);
  std::mt19937_64 random(9);
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = 0.7 * randomDirection(random), moved = before * x;
    Vec3 a, b;
    first.motion->forward({&x, 1}, {&a, 1});
    second.motion->forward({&moved, 1}, {&b, 1});
    // The table is not turned: what is linear on its triangles differs by a part of an edge's bend.
    EXPECT_LT((after * a - b).norm(), 2e-3);
  }
  EXPECT_LT((after * first.rotation * before.transpose() - second.rotation).norm(), 2e-3);
}

TEST(MatchLandmarks, SamplesOfAMapAreFollowed) {
  const auto twist = [](const Vec3& u) -> Vec3 {
    return Eigen::AngleAxisd(0.6 * std::sin(2 * u.z()) + 0.3 * u.x(), Vec3::UnitZ()) * u;
  };
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  std::vector<LandmarkPair> pairs;
  for (int i = 0; i < 300; ++i) {
    const Vec3 from = randomDirection(random);
    // Every tenth is wrong and counts little.
    const bool wrong = i % 10 == 0;
    const Vec3 noise = (wrong ? 0.3 : 0.002) * Vec3(normal(random), normal(random), normal(random));
    pairs.push_back({from, twist(from) + noise, wrong ? 1e-3 : 1.0});
  }
  MatchOptions options;
  options.samples = true;
  const LandmarkMatch match = matchLandmarks(pairs, options);
  EXPECT_TRUE(match.refined);
  EXPECT_THAT(match.stalled, IsEmpty());
  expectOneToOne(match);
  double squares = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 u = randomDirection(random);
    Vec3 image;
    match.motion->forward({&u, 1}, {&image, 1});
    squares += (image - twist(u)).squaredNorm();
  }
  EXPECT_LT(std::sqrt(squares / 1000), 1 * kDegree);
}

TEST(MatchLandmarks, RefusesWhatCannotBe) {
  EXPECT_THROW(matchLandmarks(std::vector<LandmarkPair>{}), Error);
  EXPECT_THROW(matchLandmarks(std::vector<LandmarkPair>{{Vec3::UnitX(), Vec3::UnitX(), 0}}), Error);
  const std::vector<LandmarkPair> contrary{
      {Vec3::UnitX(), Vec3::UnitX()}, {Vec3::UnitZ(), Vec3::UnitZ()}, {Vec3(1, 1e-3, 0), Vec3::UnitY()}};
  EXPECT_THROW(matchLandmarks(contrary), Error);
  MatchOptions samples;
  samples.samples = true;
  EXPECT_NO_THROW(matchLandmarks(contrary, samples)) << "samples are averaged";
  samples.coreRadius = 1;
  EXPECT_THROW(matchLandmarks(contrary, samples), Error);
}

}  // namespace
}  // namespace polestar
