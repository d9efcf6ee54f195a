#pragma once
// The choice of cells as a cut: of all star-shaped sets of a box of cells, the one of largest weight.

#include <cstdint>
#include <span>
#include <vector>

#include "polestar/polycube/polycube.h"

namespace polestar::detail {

/// Of the sets of cells of `box` that hold cell {0, 0, 0} and with every cell its neighbours towards it, one
/// whose `weight` (one a cell, in the box's order) sums to the most; the smallest one where several do. 1 for
/// cells that belong to it. Sums of weights must stay below 2^62.
///
/// A closure of largest weight is a minimum cut between the cells that gain and those that cost [Picard
/// 1976]; by augmenting paths [Boykov & Kolmogorov 2004] in whole numbers, so exactly. Cells that are in or
/// out in any case, most of them, are left out of the graph.
std::vector<char> heaviestClosure(const CellBox& box, std::span<const std::int64_t> weight);

/// Volumes of one solid and of the cells, measured alike.
struct CellVolumes {
  CellBox box;
  std::vector<double> inside;  ///< of what each cell of the box shares with the solid
  std::vector<double> all;     ///< of each cell
  double solid = 0;            ///< of the solid, also beyond the box
};

/// Volume of the intersection over that of the union.
struct BestOverlap {
  std::vector<char> chosen;  ///< of the box's cells
  double overlap = 0;
  int cuts = 0;  ///< that it took
};

/// The star-shaped set that overlaps the solid best, up to weights rounded to 2^-40 of the solid.
/// Dinkelbach's iteration [1967]: where lambda is the overlap of some set, a set has more exactly when sum
/// inside - lambda (all - inside) exceeds lambda solid over it; the heaviest set is the next one, until none
/// has more. It converges faster than linearly, in 2 to 5 cuts.
BestOverlap bestOverlap(const CellVolumes& volumes);

}  // namespace polestar::detail
