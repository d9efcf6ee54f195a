#pragma once
// A mesh as light sees it: facets that stand for a smooth surface.

#include <array>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// What light needs to know of a hit, as shown.
struct ShadingPoint {
  Vec3f normal;         ///< geometric, outward
  Vec3f shadingNormal;  ///< interpolated within creases
  Vec3f shadowOrigin;   ///< where shadow rays start: clear of the facets that a curved surface stands for
};

class SmoothMesh {
 public:
  /// Edges that turn by more than `creaseAngle` (radians) look sharp.
  SmoothMesh(TriMesh mesh, double creaseAngle);

  const TriMesh& mesh() const { return mesh_; }
  const Vec3& faceNormal(std::size_t triangle) const { return faceNormals_[triangle]; }
  /// The point with weights u and v of a triangle's corners 1 and 2.
  Vec3 point(std::size_t triangle, double u, double v) const;
  /// There; `side`: 1 for the triangle's outer side, -1 for the inner one, to which all normals then point.
  ShadingPoint shadingPoint(std::size_t triangle, float u, float v, float side = 1) const;

 private:
  TriMesh mesh_;
  std::vector<Vec3> faceNormals_;
  std::vector<std::array<Vec3f, 3>> cornerNormals_;
  std::vector<Vec3f> vertices_;
};

}  // namespace polestar::detail
