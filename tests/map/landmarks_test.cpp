// Landmarks: a motion that was hidden in pairs is found again, and pairs that no motion meets are refused by
// name.
#include "polestar/map/landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "polestar/core/error.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;

std::vector<LandmarkPair> pairsOf(const BallMotion& motion, std::size_t count, double noise = 0) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  std::vector<LandmarkPair> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 from = Vec3(normal(random), normal(random), normal(random)).normalized();
    const Vec3 off = noise * Vec3(normal(random), normal(random), normal(random));
    // Of any length.
    pairs.push_back({3 * from, 0.2 * (motion.ofDirection(from) + off)});
  }
  return pairs;
}

std::string refusal(const std::vector<LandmarkPair>& pairs) {
  try {
    fitLandmarks(pairs);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::usage);
    return error.what();
  }
  return "";
}

TEST(Landmarks, FindARotationAgain) {
  for (const double angle : {0.0, 0.4, 2.0, 3.1}) {
    const Mat3 turn = Eigen::AngleAxisd(angle, Vec3(-1, 2, 0.3).normalized()).toRotationMatrix();
    for (const std::size_t count : {std::size_t{2}, std::size_t{3}, std::size_t{20}}) {
      const LandmarkFit fit = fitLandmarks(pairsOf(BallMotion(turn), count));
      EXPECT_LT(fit.worst, 1e-6) << angle << " " << count;
      EXPECT_LT((fit.motion.rotation() - turn).norm(), 1e-5);
      EXPECT_LT(fit.motion.pull().norm(), 1e-5);
      EXPECT_EQ(fit.rotationOnly, count < 3);
    }
  }
}

TEST(Landmarks, FindAMoebiusMotionAgain) {
  const Mat3 turn = Eigen::AngleAxisd(1.3, Vec3(1, 1, 0.3).normalized()).toRotationMatrix();
  const BallMotion motion(turn, Vec3(0.3, -0.2, 0.25));
  const LandmarkFit fit = fitLandmarks(pairsOf(motion, 12));
  // The weak pull towards rotations leaves a trace.
  EXPECT_LT(fit.worst, 2e-3);
  EXPECT_LT((fit.motion.pull() - motion.pull()).norm(), 2e-3);
  const LandmarkFit noisy = fitLandmarks(pairsOf(motion, 40, 0.02));
  EXPECT_LT((noisy.motion.pull() - motion.pull()).norm(), 0.03);
  EXPECT_GT(noisy.rms, 0.01);
  EXPECT_EQ(noisy.angles.size(), 40U);
}

TEST(Landmarks, OnePairTurnsAsLittleAsItCan) {
  const LandmarkFit fit = fitLandmarks(std::vector<LandmarkPair>{{Vec3::UnitX(), Vec3::UnitY()}});
  EXPECT_LT((fit.motion.rotation() * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-12);
  EXPECT_LT((fit.motion.rotation() * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-12);
}

TEST(Landmarks, RefusesWhatCannotBe) {
  EXPECT_THAT(refusal({}), HasSubstr("none"));
  EXPECT_THAT(refusal({{Vec3::Zero(), Vec3::UnitX()}}), HasSubstr("pair 1"));
  EXPECT_THAT(refusal({{Vec3::UnitX(), Vec3::UnitX()},
                       {Vec3::UnitZ(), Vec3::UnitZ()},
                       {Vec3(1, 1e-3, 0), Vec3::UnitY()}}),
              AllOf(HasSubstr("pairs 1 and 3 contradict"), HasSubstr("90 degrees")));
  std::vector<LandmarkPair> mirrored = pairsOf(BallMotion(), 10);
  for (LandmarkPair& pair : mirrored) pair.to.y() = -pair.to.y();
  EXPECT_THAT(refusal(mirrored), HasSubstr("mirrored"));
  std::vector<LandmarkPair> shuffled = pairsOf(BallMotion(), 10);
  for (std::size_t i = 0; i + 1 < shuffled.size(); i += 2) std::swap(shuffled[i].to, shuffled[i + 1].to);
  EXPECT_THAT(refusal(shuffled), HasSubstr("mixed up"));
}

}  // namespace
}  // namespace polestar
