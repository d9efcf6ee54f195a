#pragma once
// Orientation by exact arithmetic: every verdict of the library (star test, sphere flips, foliation cells)
// rests on these signs, never on a rounded determinant.

#include "polestar/core/types.h"

namespace polestar {

/// Sign of det[b - a, c - a, d - a]: +1 when d lies on the side of the triangle (a, b, c) from which its
/// vertices run counter-clockwise, so that (a, b, c, d) is a positively oriented tetrahedron; 0 when the four
/// points are coplanar.
///
/// Exact for all finite coordinates, the smallest and the largest included; 0 where one is not finite. A
/// floating-point filter decides nearly all calls; the rest is summed in fixed-point numbers as long as that
/// takes, 0.1 to 0.3 us a call.
int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Sign of det[a, b, c]: +1 when the spherical triangle of the three directions is counter-clockwise seen
/// from outside. Exact likewise; the vectors need not have unit length.
int orientDirections(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace polestar
