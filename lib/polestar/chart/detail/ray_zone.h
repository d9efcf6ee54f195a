#pragma once
// The last resort where Green's function is below what doubles resolve, or a foliation cannot be untangled:
// field lines bend over into the rays of their vertices. Cells between rays are never inverted on a star
// shape.

#include <cstddef>
#include <vector>

#include "polestar/chart/foliation.h"
#include "polestar/core/context.h"

namespace polestar::detail {

struct RayZone {
  std::size_t lines = 0;                ///< that follow their ray, wholly or in part
  bool everywhere = false;              ///< all of them: the foliation is the radial cone
  std::vector<std::size_t> movedNodes;  ///< ids, ascending
  double largestMove = 0;               ///< inner units
};

/// Turns the lines of bad cells, and ever more of those around them with a weight that fades over the rings,
/// towards the rays of their vertices, each node at its distance from the center; after each widening what is
/// left is untangled. When no zone helps all lines become rays, and every cell is positive.
/// @throws Error{Errc::cancelled}
RayZone bendTowardsRays(Foliation& foliation, const Context& context);

}  // namespace polestar::detail
