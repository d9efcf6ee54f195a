#pragma once
// Local refinement that stays in the triangles' planes: of the layer's mesh where the boundary error sits, of
// a surface whose triangles are too wide for the map's table.

#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// A refined mesh. Its first vertices are those of the coarse one; each new vertex is the midpoint of
/// `parents`.
struct Refinement {
  TriMesh mesh;
  std::size_t coarseVertices = 0;
  std::vector<std::array<std::int32_t, 2>> parents;  ///< of vertex coarseVertices + i
  std::vector<std::uint32_t> triangleParents;        ///< the coarse triangle of each triangle
};

/// Cuts every marked triangle at its longest edge (all of them where they tie), and its neighbours as far as
/// it takes to keep the mesh conforming. Angles stay bounded by those of the coarse mesh. The result does not
/// depend on the order of vertices and triangles. O(n). [Rivara 1984]
Refinement bisectLongestEdges(const TriMesh& mesh, const std::vector<char>& marked);

}  // namespace polestar
