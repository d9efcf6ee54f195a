#pragma once
// Triangles that are there twice.

#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Triangles with the vertices of an earlier one, in any order. Cost O(n) for bounded valences.
std::vector<std::int32_t> duplicateTriangles(const TriMesh& mesh);

}  // namespace polestar::detail
