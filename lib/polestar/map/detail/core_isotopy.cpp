#include "polestar/map/detail/core_isotopy.h"

#include <algorithm>
#include <cmath>

#include "polestar/sphere/sphere_map.h"

namespace polestar::detail {
namespace {

double evenInLog(double ballRadius, double coreRadius) {
  return std::clamp(1 + std::log(ballRadius / coreRadius) / std::log(4.0), 0.0, 1.0);
}

}  // namespace

// The quintic smooth step.
double coreShare(double ballRadius, double coreRadius) {
  if (ballRadius >= coreRadius) return 1;
  const double t = evenInLog(ballRadius, coreRadius);
  return t * t * t * (10 - 15 * t + 6 * t * t);
}

double coreShareSlope(double ballRadius, double coreRadius) {
  if (ballRadius >= coreRadius || 4 * ballRadius <= coreRadius) return 0;
  const double t = evenInLog(ballRadius, coreRadius);
  return 30 * t * t * (1 - t) * (1 - t) / (ballRadius * std::log(4.0));
}

CoreIsotopy::CoreIsotopy(std::span<const Vec3> omega, std::span<const Vec3> phi,
                         std::span<const double> weight, double coreRadius)
    : coreRadius_(coreRadius), rotation_(Mat3::Identity()) {
  if (coreRadius > 0) rotation_ = bestRotation(omega, phi, weight);
}

Vec3 CoreIsotopy::direction(double ballRadius, const Vec3& omega, const Vec3& phi) const {
  if (ballRadius >= coreRadius_) return phi;
  const double share = coreShare(ballRadius, coreRadius_);
  return (share * phi + (1 - share) * (rotation_ * omega)).normalized();
}

}  // namespace polestar::detail
