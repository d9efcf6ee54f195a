#pragma once
// Single lines that were caught at a vertex or crossed their neighbours are replaced by what the lines around
// them do.

#include <cstddef>
#include <span>
#include <vector>

#include "polestar/chart/foliation.h"

namespace polestar::detail {

struct LineRepair {
  std::size_t lines = 0;                ///< replaced, besides those that had failed
  double largestMove = 0;               ///< inner units, over lines that had not failed
  std::vector<std::size_t> movedNodes;  ///< ids, ascending
  CellCounts cells;                     ///< after the repair
};

/// First gives the `failed` vertices (their inner nodes hold nothing) the mean of their neighbours' nodes,
/// level by level. Then, as long as it lowers the number of bad cells, replaces the line at the worst corner
/// of every triangle with bad cells in the same way. Nodes on the surface and the center stay.
LineRepair repairLines(Foliation& foliation, std::span<const std::int32_t> failed);

}  // namespace polestar::detail
