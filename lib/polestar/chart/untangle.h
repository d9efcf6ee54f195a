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
/// Minimizes the sum over the patch's cells of |J|^2 / (3 d^(2/3)) + kVolume (d + 1/d) / 2, J from the
/// cell's reference to its present shape, d its determinant: first with d regularized so that it may be
/// negative [Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov 2021, "Foldover-free maps in 50 lines of
/// code"], then as a barrier. The reference is the cell as it was traced where that is sound; else the same
/// cell between the rays of its vertices at its nodes' distances from the center, made to fall from level to
/// level: never inverted on a star shape. By L-BFGS, preconditioned with
/// incomplete factors of the references' Laplacian. Same result for any number of threads. Some hundred
/// passes over the patches.
/// @throws Error{Errc::cancelled}
Untangling untangle(Foliation& foliation, int rings, const Context& context);

}  // namespace polestar
