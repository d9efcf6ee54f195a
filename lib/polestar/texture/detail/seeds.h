#pragma once
// Seeds of a fruit: solid drops on an ellipsoid about the axis, each in a cell of its own, so that every cut
// shows those that it meets.

#include <cstdint>

#include "polestar/texture/detail/footprint.h"

namespace polestar::detail {

struct SeedLayout {
  double equator = 0.4, pole = 0.6;  ///< semi-axes of the ellipsoid, across and along z
  int around = 30;                   ///< cells around the axis
  int rows = 16;                     ///< of cells from pole to pole
  bool thinning = false;             ///< fewer cells around towards the poles, so that all are equally wide
  double length = 0.09, width = 0.05, thickness = 0.03;
  double scatter = 0.02;   ///< of distances from the ellipsoid, to either side
  double presence = 0.85;  ///< share of the cells that hold a seed
  std::uint32_t seed = 1;
};

struct Seed {
  bool present = false;
  /// 0 in the middle axis, 1 on the surface; a quadratic form, so its square root grows evenly.
  Varying form = 1e3;
  double along = 0;   ///< -1 at the tip, which looks at the axis, 1 at the round end
  double across = 0;  ///< around the axis, -1 to 1
  std::uint32_t hash = 0;
  double kept = 1;     ///< of seeds that are told apart; the rest are averaged
  double density = 0;  ///< share of the space around that seeds fill

  /// Share of the footprint within the drops that are `scale` times the seeds' size.
  double share(double scale, double softness, const Footprint& footprint) const;
};

/// The seed that `ball` is in or nearest to; not present where there is none near. Seeds that are smaller
/// than the footprint are told by their density.
Seed seedNear(const VaryingPoint& ball, const Footprint& footprint, const SeedLayout& layout);

}  // namespace polestar::detail
