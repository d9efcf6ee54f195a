#pragma once
// Does a surface run through itself? Exactly, by signs: what stands between "closed" and "bounds a solid" for
// surfaces that were moved.

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

struct SelfIntersections {
  std::size_t pairs = 0;  ///< of triangles that share points beyond common corners and edges
  std::optional<std::array<std::size_t, 2>> first;  ///< the pair with the smallest ids
};

/// Looks at all pairs whose boxes meet; triangles that touch count as well. Exact for finite coordinates and
/// triangles that are not flat. O(n log n) for surfaces, some microseconds a triangle; parallel.
SelfIntersections findSelfIntersections(const TriMesh& mesh);

}  // namespace polestar
