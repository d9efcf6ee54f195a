#pragma once
// Which points lie inside a star-shaped solid, from the triangle that the ray from the center meets.

#include "polestar/core/detail/aabb_tree.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// For a closed mesh, outward-oriented and star-shaped about the origin. Keeps a reference to it.
class InsideStar {
 public:
  explicit InsideStar(const TriMesh& mesh);
  /// Strictly inside, up to rounding. O(log n).
  bool contains(const Vec3& point) const;

 private:
  const TriMesh& mesh_;
  AabbTree directions_;  ///< over the unit vectors of each triangle's points
};

}  // namespace polestar::detail
