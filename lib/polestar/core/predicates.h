#pragma once
// Orientation by exact arithmetic: every verdict of the library (star test, sphere flips, foliation cells)
// rests on these signs, never on a rounded determinant.

#include "polestar/core/types.h"

namespace polestar {

/// Sign of det[b - a, c - a, d - a]: +1 when d lies on the side of the triangle (a, b, c) from which its
/// vertices run counter-clockwise, so that (a, b, c, d) is a positively oriented tetrahedron; 0 when the four
/// points are coplanar.
///
/// Exact for finite coordinates whose products neither overflow nor underflow (magnitudes within 1e-50 ..
/// 1e50 or zero; the inner frame keeps them there). A floating-point filter decides nearly all calls; the
/// rest is computed with expansions [Shewchuk 1997].
int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Sign of det[a, b, c]: +1 when the spherical triangle of the three directions is counter-clockwise seen
/// from outside. Exact in the same sense; the vectors need not have unit length.
int orientDirections(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace polestar
