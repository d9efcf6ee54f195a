#pragma once
// Closed-form potentials of linear charge densities on a triangle: the near field of the single layer.

#include <array>

#include "polestar/core/types.h"

namespace polestar::detail {

/// A triangle prepared for many evaluations.
struct LayerTriangle {
  std::array<Vec3, 3> corner;
  std::array<Vec3, 3> edge;     ///< unit, from corner k to corner k + 1
  std::array<Vec3, 3> outward;  ///< unit, in the plane, away from the triangle, normal to edge k
  std::array<double, 3> length;
  Vec3 normal;  ///< unit, outward of the surface
  double twiceArea;

  LayerTriangle(const Vec3& a, const Vec3& b, const Vec3& c);
};

/// Integrals over the triangle of the three hat functions over |x - y|.
///
/// Exact up to rounding for every x, on the triangle too. [Wilton et al. 1984; Graglia 1993]
std::array<double, 3> hatPotentials(const LayerTriangle& triangle, const Vec3& x);

struct PotentialAndGradient {
  double potential;
  Vec3 gradient;
};

/// Integral of sigma(y)/|x - y| for the linear density with the given values at the corners, and its gradient
/// in x.
///
/// On the triangle itself the gradient is its limit from the inner side (against the normal); on an edge
/// whose density is not 0 the true gradient is infinite, and a large finite one is returned.
PotentialAndGradient linearLayer(const LayerTriangle& triangle, const std::array<double, 3>& sigma,
                                 const Vec3& x);

}  // namespace polestar::detail
