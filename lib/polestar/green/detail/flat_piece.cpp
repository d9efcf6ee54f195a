#include "polestar/green/detail/flat_piece.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "polestar/green/detail/segment_integrals.h"

namespace polestar::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;
constexpr double kRounding = 1e-13;

// Between the segments p + s u and q + t v, s and t from 0 to 1.
double distanceBetween(const Vec3& p, const Vec3& u, const Vec3& q, const Vec3& v) {
  const Vec3 w = p - q;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
  const double determinant = uu * vv - uv * uv;
  // Parallel ones have a nearest pair for any s within reach; the ends are tried below.
  const double s =
      determinant > 1e-14 * uu * vv ? std::clamp((uv * vw - vv * uw) / determinant, 0.0, 1.0) : 0;
  const double t = std::clamp((uv * s + vw) / vv, 0.0, 1.0);
  double least = (w + s * u - t * v).norm();
  for (const double end : {0.0, 1.0}) {
    least = std::min(least, (w + end * u - std::clamp((uv * end + vw) / vv, 0.0, 1.0) * v).norm());
    least = std::min(least, (w - end * v + std::clamp((uv * end - uw) / uu, 0.0, 1.0) * u).norm());
  }
  return least;
}

}  // namespace

Ball ballAround(const Piece& p) {
  for (int k = 0; k < 3; ++k) {  // obtuse: the longest side is the diameter
    const Vec3 &a = p[k], &b = p[(k + 1) % 3], &c = p[(k + 2) % 3];
    if ((a - c).dot(b - c) <= 0) return {0.5 * (a + b), 0.5 * (a - b).norm()};
  }
  const Vec3 u = p[1] - p[0], v = p[2] - p[0], normal = u.cross(v);
  const Vec3 toCenter =
      (u.squaredNorm() * v.cross(normal) + v.squaredNorm() * normal.cross(u)) / (2 * normal.squaredNorm());
  // Rounding must not leave a corner outside.
  return {p[0] + toCenter,
          (1 + 1e-12) * std::max({toCenter.norm(), (toCenter - u).norm(), (toCenter - v).norm()})};
}

double distanceBetween(const Piece& piece, const Vec3& a, const Vec3& b) {
  const Vec3 normal = (piece[1] - piece[0]).cross(piece[2] - piece[0]);
  double least = kInfinity;
  // Whether the feet of the ends, and the crossing with the plane, lie within.
  const double heightA = (a - piece[0]).dot(normal), heightB = (b - piece[0]).dot(normal);
  const bool crosses = (heightA > 0) != (heightB > 0);
  const Vec3 crossing = crosses ? Vec3(a + heightA / (heightA - heightB) * (b - a)) : a;
  bool withinA = true, withinB = true, withinCrossing = crosses;
  for (int k = 0; k < 3; ++k) {
    const Vec3 side = piece[(k + 1) % 3] - piece[k], inward = normal.cross(side);
    least = std::min(least, distanceBetween(piece[k], side, a, b - a));
    withinA = withinA && (a - piece[k]).dot(inward) >= 0;
    withinB = withinB && (b - piece[k]).dot(inward) >= 0;
    withinCrossing = withinCrossing && (crossing - piece[k]).dot(inward) >= 0;
  }
  if (withinCrossing) return 0;
  const double length = normal.norm();
  if (withinA) least = std::min(least, std::abs(heightA) / length);
  if (withinB) least = std::min(least, std::abs(heightB) / length);
  return least;
}

std::array<Piece, 4> quartersOf(const Piece& corner) {
  Piece middle;
  for (int k = 0; k < 3; ++k) middle[k] = 0.5 * (corner[k] + corner[(k + 1) % 3]);
  std::array<Piece, 4> parts;
  for (int k = 0; k < 3; ++k) parts[k] = {corner[k], middle[k], middle[(k + 2) % 3]};
  parts[3] = middle;
  return parts;
}

// Largest solid angle under which points of the piece see a triangle: it lies within the half-plane beyond
// each of its edges, and such a half-plane has twice the angle between the directions to its edge and along
// it. That this angle is at most some alpha <= pi/2 is a convex condition: what holds at the corners holds
// between them. Corners on the edge itself, up to rounding, say nothing.
double largestSolidAngle(const FlatTriangle& side, const Piece& piece) {
  double smallest = kInfinity;  // tangent of the angle
  for (int k = 0; k < 3; ++k) {
    double largest = 0;
    for (const Vec3& p : piece) {
      const Vec3 offset = p - side.corner[k];
      const double before = offset.dot(side.conormal[k]), above = std::abs(offset.dot(side.normal));
      if (std::max(std::abs(before), above) <= kRounding * side.length[k]) continue;
      largest = std::max(largest, before > 0 ? above / before : kInfinity);
    }
    smallest = std::min(smallest, largest);
  }
  return std::isfinite(smallest) ? 2 * std::atan(smallest) : 2 * kPi;
}

double distanceTo(const FlatTriangle& side, const Vec3& x) {
  double nearest = kInfinity;
  bool inside = true;
  for (int k = 0; k < 3; ++k) {
    nearest = std::min(nearest, distanceToSegment(x, side.corner[k], side.corner[(k + 1) % 3]));
    inside = inside && (x - side.corner[k]).dot(side.conormal[k]) <= 0;
  }
  return inside ? std::abs((x - side.corner[0]).dot(side.normal)) : nearest;
}

bool liesOnOneSide(const FlatTriangle& triangle, const Piece& piece) {
  double length = 0;
  for (int k = 0; k < 3; ++k) length = std::max(length, (piece[(k + 1) % 3] - piece[k]).norm());
  bool above = true, below = true;
  for (const Vec3& p : piece) {
    const double height = (p - triangle.corner[0]).dot(triangle.normal);
    above = above && height >= -kRounding * length;
    below = below && height <= kRounding * length;
  }
  return above || below;
}

}  // namespace polestar::detail
