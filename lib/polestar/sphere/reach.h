#pragma once
// How far a star-shaped solid reaches in the directions from its center.
//
// Measured by the largest component of the point where the ray leaves, not by its distance: that is constant
// over a face of a cube, and rational where the surface is flat.

#include <memory>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/star/star_shape.h"

namespace polestar {

/// The direction through place (u, v), both in [-1, 1], of a face of the cube [-1, 1]^3: faces 0 to 2 look
/// along the axes, 3 to 5 against. u runs along the axis after the face's own.
Vec3 throughCubeFace(std::size_t face, double u, double v);

/// By a search among the triangles. Safe to ask from many threads.
class ExactReach {
 public:
  explicit ExactReach(const StarShape& shape);
  ~ExactReach();

  /// Largest component of the point where the ray along `direction` (any length but 0) leaves the solid,
  /// inner frame. O(log n), about 1 us.
  double reach(const Vec3& direction) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// The same looked up: bilinear on a cube's faces, 128 cells along each. Between creases good to about the
/// square of the table's spacing (1/64). Made from 100,000 rays.
class ReachTable {
 public:
  /// @throws Error{Errc::cancelled}
  ReachTable(const StarShape& shape, const Context& context);

  double reach(const Vec3& direction) const;

 private:
  std::vector<double> values_;
};

}  // namespace polestar
