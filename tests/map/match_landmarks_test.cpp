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
       {std::tuple{4u, 0.8, 20 * kDegree, 2.0}, std::tuple{12u, 0.5, 12 * kDegree, 2.5},
        std::tuple{50u, 0.25, 5 * kDegree, 3.0}, std::tuple{200u, 0.12, 2 * kDegree, 3.0}}) {
    SCOPED_TRACE(count);
    const LandmarkMatch match = matchLandmarks(scattered(count, apart, angle));
    EXPECT_TRUE(match.refined);
    EXPECT_LT(match.worst, 0.1 * kDegree);
    EXPECT_THAT(match.stalled, IsEmpty());
    EXPECT_LT(match.largestDilatation, dilatation);
    expectOneToOne(match);
    std::printf("%u pairs: worst %g degrees, dilatation %g\n", count, match.worst / kDegree,
                match.largestDilatation);
  }
}

TEST(MatchLandmarks, TurnsAround) {
  // Two places that turn about each other by `angle`, others that hold still.
  for (const double angle : {60.0, 110.0, 150.0, 180.0, 200.0}) {
    SCOPED_TRACE(angle);
    std::vector<LandmarkPair> pairs;
    for (const Vec3& u : {Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)})
      pairs.push_back({u, u});
    for (const double side : {1.0, -1.0}) {
      const Vec3 place = Vec3(0.25 * side, 0, 1).normalized();
      pairs.push_back({place, Eigen::AngleAxisd(angle * kDegree, Vec3::UnitZ()) * place});
    }
    const LandmarkMatch match = matchLandmarks(pairs);
    expectOneToOne(match);
    std::printf("%g: worst %g degrees, dilatation %g %s\n", angle, match.worst / kDegree,
                match.largestDilatation, match.stalled.c_str());
    EXPECT_EQ(match.stalled.empty(), match.worst < 1e-3);
  }
}

}  // namespace
}  // namespace polestar
