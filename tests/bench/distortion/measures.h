#pragma once
// How a map of a solid onto the ball distorts: seen from the solid, where every piece counts by its volume,
// and from the ball, where hexahedra are laid out evenly.

#include "polestar/map/ball_map.h"

namespace polestar::bench {

/// At points spread evenly over the solid.
struct SolidDistortion {
  std::size_t points = 0, folded = 0;  ///< folded: det J <= 0, not counted below
  double mipsMean = 0, mipsP99 = 0;    ///< |J|^2 / (3 det J^(2/3)) >= 1
  double logVolumeDeviation = 0;       ///< standard deviation of ln det J
};
SolidDistortion measureSolid(const VolumeMap& map, const StarShape& shape, std::size_t points);

/// Scaled Jacobians of hexahedra that are even in the ball: `cells`^2 a side of a cubed sphere (equal
/// angles), `cells` layers from 0.1 to the surface; the least of a hexahedron's eight corners.
struct HexDistortion {
  std::size_t cells = 0, bad = 0;  ///< bad: not positive, or a corner without a preimage
  double min = 0, p1 = 0, mean = 0;
};
HexDistortion measureHexahedra(const VolumeMap& map, int cells);

}  // namespace polestar::bench
