#pragma once
// Where rays from the center leave a mapped solid.

#include <span>
#include <vector>

#include "polestar/map/ball_map.h"

namespace polestar::detail {

struct RayExit {
  Vec3 direction;   ///< phi(q): where the surface's point q on the ray goes on the sphere, unit vector
  double distance;  ///< |q - c|, mesh units
};

/// For directions from the map's center, any length but zero.
std::vector<RayExit> rayExits(const BallMap& map, std::span<const Vec3> directions);

}  // namespace polestar::detail
