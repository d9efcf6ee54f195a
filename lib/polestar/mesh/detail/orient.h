#pragma once
// Which triangles must be turned so that neighbours agree.

#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Flood-fills across the edges of exactly two triangles: 1 for a triangle that must be turned. Each
/// connected part keeps the orientation of most of its triangles (of its first one when they are even).
/// One-sided parts end up with edges where neighbours disagree. Cost O(n).
std::vector<char> turnsForAgreement(const TriMesh& mesh);

}  // namespace polestar::detail
