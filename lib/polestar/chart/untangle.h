#pragma once
// Turns over cells of the foliation that came out inverted, near the place and nowhere else.
//
// An exact field still gives inverted cells where a triangle of the surface is large beside a dent, and an
// inexact one at creases. Both are cured by moving nodes a little; how many and how far is told.

#include <cstddef>
#include <vector>

#include "polestar/chart/foliation.h"
#include "polestar/core/context.h"

namespace polestar {

struct Untangling {
  std::vector<std::size_t> movedNodes;  ///< ids, ascending
  double largestMove = 0;               ///< inner units
};

/// Moves inner nodes within `rings` edges and levels of bad cells, each connected patch by itself; nodes
/// elsewhere, on the surface and at the center stay to the last bit. Patches of more than 20,000 nodes are
/// left alone. A patch keeps its new places only when
/// they leave fewer bad cells than it had.
///
/// By core/detail/untangle_tets.h. A cell's reference is the cell as it was traced where that is sound; else
/// the same cell between the rays of its vertices at its nodes' distances from the center, made to fall from
/// level to level: never inverted on a star shape. Same result for any number of threads.
/// @throws Error{Errc::cancelled}
Untangling untangle(Foliation& foliation, int rings, const Context& context);

}  // namespace polestar
