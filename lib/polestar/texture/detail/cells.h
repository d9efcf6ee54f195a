#pragma once
// Cellular noise: space divided among the random points of a jittered lattice (Voronoi cells), one point a
// unit cube [Worley 1996].

#include <cstdint>

#include "polestar/texture/detail/footprint.h"

namespace polestar::detail {

struct Cell {
  std::uint32_t hash = 0;       ///< of the cell that the point is in
  std::uint32_t neighbour = 0;  ///< of the one beyond the nearest wall
  Varying wall;                 ///< distance from that wall, >= 0, in units of the lattice
  Varying center;               ///< distance from the cell's own point, same units
};

/// `jitter` 0: cubes, 1: points anywhere in their cube.
Cell cellAt(const VaryingPoint& domain, double jitter, std::uint32_t seed);

/// How cells vary, as Footprint::kept takes it.
inline constexpr double kCellSpread = 2.4;

}  // namespace polestar::detail
