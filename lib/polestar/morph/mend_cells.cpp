#include "polestar/morph/mend_cells.h"

#include <algorithm>

#include "polestar/chart/untangle.h"

namespace polestar {

Mending mendCells(const Foliation& ball, std::vector<Vec3>& nodes, const Context& context) {
  constexpr int kRings[] = {1, 2, 4};
  constexpr double kMostShare = 1e-3;
  Mending mending;
  mending.badBefore = mending.badAfter = countCells(ball, nodes).bad();
  if (mending.badBefore == 0) return mending;
  if (static_cast<double>(mending.badBefore) > kMostShare * static_cast<double>(ball.cellCount()))
    return mending;
  double unit = 0;
  for (std::size_t v = 0; v < ball.vertexCount; ++v) unit = std::max(unit, nodes[v].norm());
  Foliation solid = ball;
  for (std::size_t id = 0; id < nodes.size(); ++id) solid.nodes[id] = nodes[id] / unit;
  std::vector<char> moved(nodes.size(), 0);
  const std::vector<Vec3> given = nodes;
  for (const int rings : kRings) {
    for (const std::size_t id : untangle(solid, rings, context).movedNodes) {
      nodes[id] = unit * solid.nodes[id];
      moved[id] = 1;
    }
    mending.badAfter = countCells(ball, nodes).bad();
    if (mending.badAfter == 0) break;
  }
  for (std::size_t id = 0; id < nodes.size(); ++id) {
    if (!moved[id]) continue;
    ++mending.moved;
    mending.largestMove = std::max(mending.largestMove, (nodes[id] - given[id]).norm());
  }
  return mending;
}

}  // namespace polestar
