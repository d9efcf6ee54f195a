// Motions of the ball: one to one, differentiable, spheres stay where they are, the core only turns.
#include "polestar/map/ball_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "polestar/core/error.h"

namespace polestar {
namespace {

const Mat3 kTurn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -0.5).normalized()).toRotationMatrix();

std::vector<Vec3> ballPoints(std::size_t count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vec3> points;
  while (points.size() < count) {
    const Vec3 x(uniform(random), uniform(random), uniform(random));
    if (x.norm() < 1) points.push_back(x);
  }
  points.emplace_back(Vec3::Zero());
  points.emplace_back(0, 0, 1);
  return points;
}

TEST(BallMotion, KeepsSpheresAndComesBack) {
  const BallMotion motion(kTurn, Vec3(0.5, -0.3, 0.4));
  const std::vector<Vec3> points = ballPoints(2000);
  std::vector<Vec3> there(points.size()), back(points.size());
  motion.forward(points, there);
  motion.inverse(there, back);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(there[i].norm(), points[i].norm(), 1e-14);
    EXPECT_LT((back[i] - points[i]).norm(), 1e-13);
    if (points[i].norm() < 0.25) {
      EXPECT_LT((there[i] - kTurn * points[i]).norm(), 1e-15);
    }
  }
}

TEST(BallMotion, JacobianIsTheDerivativeAndNeverTurnsOver) {
  const BallMotion motion(kTurn, Vec3(0.6, 0.2, -0.5));
  std::vector<Vec3> points = ballPoints(1000);
  std::erase_if(points, [](const Vec3& x) { return x.norm() > 0.999; });
  std::vector<Mat3> jacobians(points.size());
  motion.jacobian(points, jacobians);
  constexpr double step = 1e-6;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Mat3 differences;
    for (int k = 0; k < 3; ++k) {
      const std::array<Vec3, 2> around{points[i] + step * Vec3::Unit(k), points[i] - step * Vec3::Unit(k)};
      std::array<Vec3, 2> images;
      motion.forward(around, images);
      differences.col(k) = (images[0] - images[1]) / (2 * step);
    }
    EXPECT_LT((jacobians[i] - differences).norm(), 1e-7 * (1 + jacobians[i].norm())) << points[i].transpose();
    EXPECT_GT(jacobians[i].determinant(), 0);
  }
}

// On the surface the motion is conformal: two tangents keep their angle and their ratio of lengths.
TEST(BallMotion, IsConformalOnTheSurface) {
  const BallMotion motion(kTurn, Vec3(0.1, 0.7, 0.2));
  for (Vec3 d : ballPoints(100)) {
    if (d.isZero(0)) continue;
    d.normalize();
    const Vec3 first = d.unitOrthogonal(), second = d.cross(first);
    constexpr double step = 1e-6;
    const Vec3 a = (motion.ofDirection(d + step * first) - motion.ofDirection(d - step * first)) / (2 * step);
    const Vec3 b =
        (motion.ofDirection(d + step * second) - motion.ofDirection(d - step * second)) / (2 * step);
    EXPECT_NEAR(a.norm() / b.norm(), 1, 1e-7);
    EXPECT_NEAR(a.dot(b) / (a.norm() * b.norm()), 0, 1e-7);
  }
}

TEST(BallMotion, OutsideIsNowhereAndNonsenseIsRefused) {
  const BallMotion motion(kTurn, Vec3(0.1, 0, 0));
  const Vec3 outside(1.1, 0, 0);
  Vec3 image;
  motion.forward({&outside, 1}, {&image, 1});
  EXPECT_TRUE(image.hasNaN());
  EXPECT_THROW(BallMotion(-Mat3::Identity()), Error);
  EXPECT_THROW(BallMotion(2 * Mat3::Identity()), Error);
  EXPECT_THROW(BallMotion(kTurn, Vec3(0, 0, 1)), Error);
}

}  // namespace
}  // namespace polestar
