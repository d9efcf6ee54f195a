#pragma once
// Signs of determinants, right for all finite doubles, the smallest and the largest included.

#include "vec3.h"

namespace polestar::verify {

/// Sign of det[a, b, c]: +1 when the cone over a, b, c runs counter-clockwise seen from outside.
///
/// A rounded determinant decides when it exceeds its error bound; otherwise the coordinates are taken as
/// integers times a common power of two, and the determinant is computed in integers of any length.
/// Coordinates must be finite.
int signOfDeterminant(const Vec3& a, const Vec3& b, const Vec3& c);

/// Sign of det[b - a, c - a, d - a], the orientation of the tetrahedron a, b, c, d. Likewise.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

}  // namespace polestar::verify
