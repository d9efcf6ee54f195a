#pragma once
// The graph form of a Laplacian: what the Dirichlet energy sums over.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Symmetric weights w_ij >= 0 between vertices, stored by rows: (L x)_i = sum_j w_ij (x_i - x_j).
struct Laplacian {
  std::vector<std::size_t> rowStart;  ///< size() + 1 offsets into `column` and `weight`
  std::vector<std::int32_t> column;   ///< ascending in each row, never the row itself
  std::vector<double> weight;

  std::size_t size() const { return rowStart.size() - 1; }
};

/// Cotangent Laplacian of the intrinsic Delaunay triangulation of a closed manifold mesh.
///
/// The weights are never negative and depend on the polyhedron alone, not on how its flat parts are
/// triangulated; an edge that could be flipped either way has weight zero, so rounding of the vertices moves
/// the weights only by rounding. Triangles of (nearly) no area are first given some by adding one tiny length
/// to every edge. Cost O(n) in practice. [Bobenko, Springborn 2007; Sharp, Crane 2020, "intrinsic
/// mollification"]
Laplacian intrinsicDelaunayLaplacian(const TriMesh& mesh);

/// A third of the area of each vertex's triangles, in units of the surface's area: sums to 1.
std::vector<double> vertexAreaShares(const TriMesh& mesh);

}  // namespace polestar::detail
