#pragma once
// The rims of holes.

#include <vector>

#include "polestar/core/detail/edge_table.h"
#include "polestar/mesh/closed_surface.h"

namespace polestar::detail {

/// Chains the edges of one triangle into loops, or into open paths where they end at a non-manifold edge.
/// Where several sheets touch in a vertex, a loop stays on its sheet. Triangles must not repeat vertices.
/// Cost O(b log b) in the number of boundary edges.
std::vector<Hole> boundaryLoops(const TriMesh& mesh, const EdgeTable& edges);

}  // namespace polestar::detail
