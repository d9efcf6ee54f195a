#pragma once
// The triangles that all shapes of a morph share: a triangulation of the sphere of directions, fine enough
// that its image in every shape's surface lies where that surface does.

#include <vector>

#include "polestar/core/context.h"
#include "polestar/map/surface_points.h"
#include "polestar/morph/morph_complex.h"

namespace polestar::detail {

/// One shape's boundary, asked in directions of the common ball.
class CommonBoundary {
 public:
  explicit CommonBoundary(const MorphShape& shape);

  /// Points of the surface, from the center, mesh units, not turned back.
  void at(std::span<const Vec3> directions, std::span<Vec3> surface) const;
  /// The same of points of the common ball, inside the solid.
  void inside(std::span<const Vec3> ball, std::span<Vec3> solid) const;

  /// Vertices of the surface and the middles of its edges, from the center, mesh units; and their directions
  /// in the common ball.
  const std::vector<Vec3>& samples() const { return samples_; }
  const std::vector<Vec3>& directions() const { return directions_; }
  /// Of the vertices alone, in the surface's order.
  std::span<const Vec3> vertexDirections() const;

 private:
  const MorphShape& shape_;
  SurfacePoints surface_;
  std::vector<Vec3> samples_, directions_;
};

struct CommonSphere {
  TriMesh mesh;  ///< of unit vectors
  int rounds = 0;
  std::vector<double> worst, rms;  ///< distances of each shape's samples from the triangles
};

/// @throws Error{Errc::cancelled}
CommonSphere commonSphere(std::span<const CommonBoundary> boundaries, std::span<const MorphShape> shapes,
                          const MorphOptions& options, Context& context);

}  // namespace polestar::detail
