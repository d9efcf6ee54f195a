#include "polestar/map/ball_motion.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/map/detail/unit_ball.h"

namespace polestar {
namespace {

using detail::isInUnitBall;
using detail::nowhere;

/// M_a(d), |d| = 1.
Vec3 moebius(const Vec3& a, const Vec3& d) {
  const double ad = a.dot(d), aa = a.squaredNorm();
  return (2 * (1 + ad) * a + (1 - aa) * d) / (1 + 2 * ad + aa);
}

}  // namespace

BallMotion::BallMotion(const Mat3& rotation, const Vec3& pull, double coreRadius)
    : rotation_(rotation), pull_(pull), core_(coreRadius) {
  const bool orthogonal = (rotation.transpose() * rotation - Mat3::Identity()).norm() < 1e-9;
  if (!orthogonal || !(rotation.determinant() > 0))
    throw Error(Errc::usage, "a ball is moved by rotations, not by mirroring or stretching it");
  if (!(pull.norm() < 1)) throw Error(Errc::usage, "the pull of a motion of the ball must be shorter than 1");
  if (!(coreRadius >= 0 && coreRadius < 1)) throw Error(Errc::usage, "the core's radius must lie in [0, 1)");
}

// The quintic smooth step.
double BallMotion::share(double radius) const {
  const double t = std::clamp((radius - core_) / (1 - core_), 0.0, 1.0);
  return t * t * t * (10 + t * (6 * t - 15));
}

double BallMotion::shareSlope(double radius) const {
  const double t = std::clamp((radius - core_) / (1 - core_), 0.0, 1.0);
  return 30 * t * t * (1 - t) * (1 - t) / (1 - core_);
}

Vec3 BallMotion::ofDirection(const Vec3& direction) const {
  return rotation_ * moebius(pull_, direction.normalized());
}

void BallMotion::forward(std::span<const Vec3> from, std::span<Vec3> to) const {
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double r = from[i].norm();
    if (!isInUnitBall(from[i])) {
      to[i] = nowhere();
    } else if (r <= core_ || pull_.isZero(0)) {
      to[i] = rotation_ * from[i];
    } else {
      to[i] = r * (rotation_ * moebius(share(r) * pull_, from[i] / r));
    }
  }
}

// M_a and M_-a undo each other.
void BallMotion::inverse(std::span<const Vec3> to, std::span<Vec3> from) const {
  for (std::size_t i = 0; i < to.size(); ++i) {
    const double r = to[i].norm();
    const Vec3 turned = rotation_.transpose() * to[i];
    if (!isInUnitBall(to[i])) {
      from[i] = nowhere();
    } else if (r <= core_ || pull_.isZero(0)) {
      from[i] = turned;
    } else {
      from[i] = r * moebius(-share(r) * pull_, turned / r);
    }
  }
}

void BallMotion::jacobian(std::span<const Vec3> from, std::span<Mat3> derivative) const {
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double r = from[i].norm();
    derivative[i] = rotation_;
    if (!isInUnitBall(from[i])) derivative[i].setConstant(std::numeric_limits<double>::quiet_NaN());
    if (!isInUnitBall(from[i]) || r <= core_ || pull_.isZero(0)) continue;
    // y = r M(a, d) with a = s(r) pull, d = x / r; M = N / D.
    const Vec3 d = from[i] / r, a = share(r) * pull_;
    const double ad = a.dot(d), aa = a.squaredNorm(), bottom = 1 + 2 * ad + aa;
    const Vec3 m = moebius(a, d);
    const Mat3 byDirection =
        (2 * a * a.transpose() + (1 - aa) * Mat3::Identity() - m * (2 * a).transpose()) / bottom;
    const Mat3 byPull = (2 * a * d.transpose() + 2 * (1 + ad) * Mat3::Identity() - 2 * d * a.transpose() -
                         m * (2 * (a + d)).transpose()) /
                        bottom;
    const Mat3 across = Mat3::Identity() - d * d.transpose();
    derivative[i] = rotation_ * (m * d.transpose() + byDirection * across +
                                 r * shareSlope(r) * (byPull * pull_) * d.transpose());
  }
}

}  // namespace polestar
