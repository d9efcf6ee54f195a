#pragma once
// Straight cells between nodes that are where they should be can turn over all the same: where a body is
// thin, and where two of them are blended. A few inner nodes, moved by less than a cell, put that right.

#include <cstddef>
#include <vector>

#include "polestar/chart/foliation.h"
#include "polestar/core/context.h"

namespace polestar {

struct Mending {
  std::size_t badBefore = 0, badAfter = 0;  ///< cells, inverted or flat
  std::size_t moved = 0;                    ///< nodes
  double largestMove = 0;                   ///< in the nodes' unit
};

/// Untangles the cells around those that are inverted (chart/untangle.h); nodes on the surface, at the center
/// and elsewhere stay to the last bit. `nodes` are those of `ball`, from the center. Where more than one cell
/// in a thousand is bad nothing is tried: moving nodes would not be mending any more.
/// @throws Error{Errc::cancelled}
Mending mendCells(const Foliation& ball, std::vector<Vec3>& nodes, const Context& context);

}  // namespace polestar
