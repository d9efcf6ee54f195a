#include "polestar/map/detail/core_isotopy.h"

#include <algorithm>

#include "polestar/sphere/sphere_map.h"

namespace polestar::detail {

CoreIsotopy::CoreIsotopy(std::span<const Vec3> omega, std::span<const Vec3> phi,
                         std::span<const double> weight, double coreRadius)
    : coreRadius_(coreRadius), rotation_(Mat3::Identity()) {
  if (coreRadius > 0) rotation_ = bestRotation(omega, phi, weight);
}

Vec3 CoreIsotopy::direction(double ballRadius, const Vec3& omega, const Vec3& phi) const {
  if (ballRadius >= coreRadius_) return phi;
  // 0 at coreRadius / 4, 1 at coreRadius, with two continuous derivatives.
  const double t = std::clamp((4 * ballRadius / coreRadius_ - 1) / 3, 0.0, 1.0);
  const double share = t * t * t * (10 - 15 * t + 6 * t * t);
  return (share * phi + (1 - share) * (rotation_ * omega)).normalized();
}

}  // namespace polestar::detail
