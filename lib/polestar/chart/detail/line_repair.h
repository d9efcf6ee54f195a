#pragma once
// Single lines that were caught at a vertex or crossed their neighbours are replaced by what the lines around
// them do.

#include <cstddef>
#include <functional>
#include <set>
#include <span>
#include <vector>

#include "polestar/chart/foliation.h"

namespace polestar::detail {

struct LineRepair {
  std::size_t retraced = 0;             ///< followed again from another start
  std::size_t lines = 0;                ///< replaced, besides those that had failed
  double largestMove = 0;               ///< inner units, over lines that had not failed
  std::vector<std::size_t> movedNodes;  ///< ids, ascending; those of lines that were followed again are none
  std::size_t badCells = 0;             ///< after the repair
};

/// Follows the lines of some vertices again, writing their inner nodes; a line that fails stays as it was.
/// `attempt` says from which start.
using Retrace = std::function<void(const std::set<std::int32_t>& vertices, int attempt)>;
constexpr int kRetraces = 3;

/// First gives the `failed` vertices (their inner nodes hold nothing) the mean of their neighbours' nodes,
/// level by level. Then, as long as it lowers the number of bad cells, has the line at the worst corner of
/// every triangle with bad cells followed again from other starts, and replaces it in the same way as the
/// failed ones. Nodes on the surface and the center stay.
LineRepair repairLines(Foliation& foliation, std::span<const std::int32_t> failed, const Retrace& retrace);

}  // namespace polestar::detail
