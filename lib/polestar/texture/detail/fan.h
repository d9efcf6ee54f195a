#pragma once
// Directions that fan out from an axis, as the flesh of a fruit does from its core: square to the axis in the
// middle, along it at its ends.

#include "polestar/texture/detail/footprint.h"
#include "polestar/texture/detail/noise.h"

namespace polestar::detail {

/// A point as (foot, direction, distance): point = foot * z + distance * direction. Lines of constant foot
/// and direction are straight and never meet within the ball but on the axis.
struct Fan {
  Varying foot;  ///< height on the z axis
  Varying distance;
  VaryingPoint direction;  ///< unit; its gradient grows as 1 / distance

  /// The axis reaches from -halfLength to halfLength; 0: all directions start from the center.
  Fan(const VaryingPoint& ball, double halfLength);
};

/// Direction alone, for the fibers of a fruit; 0 on the axis.
Vec3 fanDirection(const Vec3& ball, double halfLength);

struct Streaks {
  double thickness = 0.02;  ///< ball radii, about the same at all distances from the axis
  double stretch = 10;      ///< length over thickness
};

/// Noise that is drawn out along the fan, mean 0. Variance about 1. Streaks part as the fan opens, so that
/// they keep their thickness; towards the axis they run together and give way to their mean.
Varying fanStreaks(const Fan& fan, const Footprint& footprint, const Streaks& streaks, std::uint32_t seed);

}  // namespace polestar::detail
