#pragma once
// What the maps of the unit ball onto itself agree on: where it ends, and what is outside.

#include <limits>

#include "polestar/core/types.h"

namespace polestar::detail {

/// Farther out is no point of the ball, but rounding.
inline bool isInUnitBall(const Vec3& x) {
  constexpr double kOutside = 1 + 1e-6;
  return x.squaredNorm() <= kOutside * kOutside;
}

inline Vec3 nowhere() { return Vec3::Constant(std::numeric_limits<double>::quiet_NaN()); }

}  // namespace polestar::detail
