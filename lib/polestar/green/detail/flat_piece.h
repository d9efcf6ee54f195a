#pragma once
// Flat pieces of a surface as bounds look at them: from where they are seen, how far they are, how large.

#include <array>

#include "polestar/core/types.h"

namespace polestar::detail {

/// A ball that the point is known to lie in.
struct Ball {
  Vec3 center;
  double radius;
};

/// A triangle cut out of one of the surface's, as its corners.
using Piece = std::array<Vec3, 3>;

/// The smallest ball around a triangle.
Ball ballAround(const Piece& piece);

/// The pieces that a piece is cut into: halves of its sides.
std::array<Piece, 4> quartersOf(const Piece& piece);

/// Between a piece and the segment from a to b.
double distanceBetween(const Piece& piece, const Vec3& a, const Vec3& b);

/// A triangle of the surface with its frame.
struct FlatTriangle {
  std::array<Vec3, 3> corner, conormal;  ///< of side k, from corner k to k + 1: outward, in the plane
  std::array<double, 3> length{};        ///< of the sides
  Vec3 normal = Vec3::Zero();
  double area = 0;
};

/// To its sides, or to its plane where the foot lies inside.
double distanceTo(const FlatTriangle& triangle, const Vec3& x);

/// Largest solid angle, from above, under which points of the piece see the triangle.
double largestSolidAngle(const FlatTriangle& triangle, const Piece& piece);

/// Whether the piece lies on one side of the triangle's plane, up to rounding.
bool liesOnOneSide(const FlatTriangle& triangle, const Piece& piece);

}  // namespace polestar::detail
