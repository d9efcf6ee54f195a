#include "polestar/map/domain_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "polestar/core/error.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/shell_map.h"

namespace polestar {
namespace {

/// Grids hold domain coordinates as floats.
constexpr double kRounding = 1e-6;
constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

/// Of the ball; what lies outside goes where the sphere's point below it goes.
void moveBall(const VolumeMap& motion, bool backward, std::span<Vec3> ball) {
  std::vector<Vec3> pulled(ball.begin(), ball.end());
  for (Vec3& y : pulled) {
    if (y.squaredNorm() > 1) y.normalize();
  }
  std::vector<Vec3> moved(ball.size());
  if (backward) {
    motion.inverse(pulled, moved);
  } else {
    motion.forward(pulled, moved);
  }
  for (std::size_t i = 0; i < ball.size(); ++i) ball[i] = std::max(1.0, ball[i].norm()) * moved[i];
}

}  // namespace

DomainMap::DomainMap(BallMap solid, std::shared_ptr<const VolumeMap> motion, BallMap domain,
                     DomainShape shape)
    : solid_(std::move(solid)),
      motion_(std::move(motion)),
      domain_(std::move(domain)),
      shape_(std::move(shape)),
      solidSurface_(solid_),
      domainSurface_(domain_) {
  if (!dynamic_cast<const BallMotion*>(motion_.get()) && !dynamic_cast<const ShellMap*>(motion_.get()))
    throw Error(Errc::usage,
                "between the balls of a solid and its domain there is a BallMotion or a ShellMap");
}

void DomainMap::forward(std::span<const Vec3> solid, std::span<Vec3> domain) const {
  std::vector<Vec3> ball(solid.size());
  solid_.forward(solid, ball);
  sampleFromBall(ball, domain);
}

void DomainMap::inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const {
  std::vector<Vec3> ball(domain.size());
  std::vector<double> green(domain.size());
  domain_.sample(domain, ball, green);
  for (Vec3& y : ball) {
    if (const double norm = y.norm(); norm > 1) y *= norm <= 1 + kRounding ? 1 / norm : kNowhere;
  }
  moveBall(*motion_, true, ball);
  solidSurface_.continuedInverse(ball, solid);
}

void DomainMap::jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const {
  std::vector<Vec3> ball(solid.size()), moved(solid.size()), domain(solid.size());
  std::vector<Mat3> turning(solid.size()), entering(solid.size());
  solid_.forward(solid, ball);
  solid_.jacobian(solid, derivative);
  motion_->forward(ball, moved);
  motion_->jacobian(ball, turning);
  domain_.inverse(moved, domain);
  domain_.jacobian(domain, entering);
  for (std::size_t i = 0; i < solid.size(); ++i)
    derivative[i] = entering[i].inverse() * turning[i] * derivative[i];
}

void DomainMap::sample(std::span<const Vec3> solid, std::span<Vec3> domain, std::span<double> green) const {
  std::vector<Vec3> ball(solid.size());
  solid_.sample(solid, ball, green);
  sampleFromBall(ball, domain);
}

void DomainMap::sampleFromBall(std::span<const Vec3> ball, std::span<Vec3> domain) const {
  std::vector<Vec3> moved(ball.begin(), ball.end());
  moveBall(*motion_, false, moved);
  domainSurface_.continuedInverse(moved, domain);
}

void DomainMap::sampleInverse(std::span<const Vec3> domain, std::span<Vec3> solid) const {
  std::vector<Vec3> ball(domain.size());
  std::vector<double> green(domain.size());
  domain_.sample(domain, ball, green);
  moveBall(*motion_, true, ball);
  solidSurface_.continuedInverse(ball, solid);
}

}  // namespace polestar
