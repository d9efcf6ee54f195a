#pragma once
// Cellular noise: space divided among the random points of a jittered lattice (Voronoi cells), one point a
// unit cube [Worley 1996].

#include <array>
#include <cstdint>

#include "polestar/texture/detail/footprint.h"

namespace polestar::detail {

struct Cell {
  /// Of the cell that the point is in, then of the two whose points are next nearest.
  std::array<std::uint32_t, 3> hash{};
  /// Distance from the plane halfway to each of those two, >= 0, in units of the lattice.
  std::array<Varying, 2> walls;
  Varying center;  ///< distance from the cell's own point, same units

  /// Shares of the footprint in the three cells. `softness` is that of the walls.
  std::array<double, 3> shares(double softness, const Footprint& footprint) const;
};

/// `jitter` 0: cubes, 1: points anywhere in their cube.
Cell cellAt(const VaryingPoint& domain, double jitter, std::uint32_t seed);

/// How cells vary, as Footprint::kept takes it.
inline constexpr double kCellSpread = 2.4;

}  // namespace polestar::detail
