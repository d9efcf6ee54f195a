#include "polestar/map/detail/core_isotopy.h"

#include <algorithm>
#include <cmath>

#include "polestar/sphere/sphere_map.h"

namespace polestar::detail {

CoreIsotopy::CoreIsotopy(std::span<const Vec3> omega, std::span<const Vec3> phi,
                         std::span<const double> weight, double coreRadius)
    : coreRadius_(coreRadius), rotation_(Mat3::Identity()) {
  if (coreRadius > 0) rotation_ = bestRotation(omega, phi, weight);
}

Vec3 CoreIsotopy::direction(double ballRadius, const Vec3& omega, const Vec3& phi) const {
  if (ballRadius >= coreRadius_) return phi;
  // 0 at coreRadius / 4, 1 at coreRadius, with two continuous derivatives; in the logarithm of R, because
  // what turns is seen from the center, and grids resolve the outer part of the core better than the inner.
  const double t = std::clamp(1 + std::log(ballRadius / coreRadius_) / std::log(4.0), 0.0, 1.0);
  const double share = t * t * t * (10 - 15 * t + 6 * t * t);
  return (share * phi + (1 - share) * (rotation_ * omega)).normalized();
}

}  // namespace polestar::detail
