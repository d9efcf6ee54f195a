#pragma once
// Integrals of powers of 1/r over edges and flat pieces, from above, by the distance alone: the bricks of the
// bounds for a layer's variation.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "polestar/core/types.h"

namespace polestar::detail {

inline double distanceToSegment(const Vec3& x, const Vec3& a, const Vec3& b) {
  const Vec3 edge = b - a, offset = x - a;
  const double along = std::clamp(edge.dot(offset) / edge.squaredNorm(), 0.0, 1.0);
  return (offset - along * edge).norm();
}

// Integrals of 1/r, 1/r^2 and 1/r^3 along a segment, at a distance d from it at least: largest with the foot
// of the point in its middle.
inline double lineIntegral1(double length, double d) {
  return d > 0 ? 2 * std::asinh(length / (2 * d)) : std::numeric_limits<double>::infinity();
}
inline double lineIntegral2(double length, double d) {
  return d > 0 ? 2 / d * std::atan(length / (2 * d)) : std::numeric_limits<double>::infinity();
}
inline double lineIntegral3(double length, double d) {
  return d > 0 ? length / (d * d * std::sqrt(d * d + 0.25 * length * length))
               : std::numeric_limits<double>::infinity();
}

// Integral of 1/r^3 over a flat piece of this area, at a distance d at least: largest for a disc about the
// foot of the point, with r at least d.
inline double areaIntegral3(double area, double d) {
  if (!(d > 0)) return std::numeric_limits<double>::infinity();
  const double radius = std::sqrt(area / std::numbers::pi);
  return radius > d ? std::numbers::pi * (3 / d - 2 / radius) : area / (d * d * d);
}

}  // namespace polestar::detail
