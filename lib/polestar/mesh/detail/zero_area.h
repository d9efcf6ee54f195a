#pragma once
// Triangles whose corners are distinct but lie on a line.

#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Mends zero-area triangles without changing the shape or opening the surface: the neighbour across the
/// longest edge is cut in two at the opposite corner (an edge flip), or an edge of rounding size is
/// collapsed. Triangles where neither is possible stay. Vertices may become unused; collapsed triangles
/// vanish, all others keep their order.
///
/// Zero area: the height over the longest side is within the rounding of the coordinates. Triangles must not
/// repeat a vertex. Returns the number of triangles mended. Cost O(n), plus O(m log m) in their number.
std::size_t mendZeroArea(TriMesh& mesh);

}  // namespace polestar::detail
