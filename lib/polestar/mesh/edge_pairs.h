#pragma once
// What is enough to know of a surface before it is voxelized: any number of parts, of any genus, may pass.

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// Whether every edge is run through as often one way as the other: no holes, and triangles agree with their
/// neighbours. By a sum of hashes, which is wrong once in 2^64. Cost O(n), a few ns a triangle.
bool edgesPair(const TriMesh& mesh);

/// Whether some part of a mesh whose edges pair faces the other way than the whole does: a cavity. Cost O(n).
bool hasCavities(const TriMesh& mesh);

}  // namespace polestar
