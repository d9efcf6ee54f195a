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

/// Follows the lines of some vertices again, writing their inner nodes; a line that fails stays as it was.
/// `attempt` says from which start.
using Retrace = std::function<void(const std::set<std::int32_t>& vertices, int attempt)>;
constexpr int kRetraces = 3;

/// Gives vertices whose inner nodes hold nothing the mean of their neighbours' nodes, level by level.
void fillLines(Foliation& foliation, std::span<const std::int32_t> failed);

struct RetracedLines {
  std::size_t kept = 0;            ///< lines that were better from another start
  std::set<std::int32_t> touched;  ///< these, and those that went back to where they were
};
/// Has the line at the worst corner of every triangle with bad cells followed again from other starts; what
/// does not lower the number of bad cells is undone.
RetracedLines retraceLines(Foliation& foliation, const Retrace& retrace);

struct ReplacedLines {
  std::set<std::int32_t> lines;  ///< vertices
  std::size_t badCells = 0;      ///< after the repair
};
/// Replaces such lines by the mean of their neighbours, as long as that lowers the number of bad cells. Nodes
/// on the surface and the center stay.
ReplacedLines replaceLines(Foliation& foliation);

}  // namespace polestar::detail
