#pragma once
// One triangle's layer in closed form, a point at a time: for proofs, which now and then need more than the
// near field's reach.

#include <array>

#include "polestar/green/detail/flat_piece.h"

namespace polestar::detail {

/// Gradient in x of the integral of sigma(y)/|x - y| over the triangle, sigma linear with these values at the
/// corners. Off the triangle's edges; on the triangle, without the normal part.
///
/// By parts: edges by logarithms, the rest by the solid angle. [Wilton et al. 1984; Graglia 1993] Relative
/// to the terms 1e-15, which for triangles far away is less than 1e-12 of the result.
Vec3 layerGradient(const FlatTriangle& triangle, const std::array<double, 3>& density, const Vec3& slope,
                   const Vec3& x);

}  // namespace polestar::detail
