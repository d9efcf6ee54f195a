#pragma once
// How often a closed surface covers the directions around the origin: once around a star-shaped solid seen
// from its center, and once for a one-to-one map to the sphere. Positive triangles alone do not exclude a
// surface that winds around twice.

#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar {

/// Cones of triangles over one direction, positively oriented ones less the others. For a closed oriented
/// surface that misses the origin this is its winding number there, whatever the direction; for vertices on
/// the sphere the degree of the map.
///
/// Exact for all finite coordinates. The direction is (1, e, e^2) with an infinitesimal e: it lies on the rim
/// of no cone that has an inside, so none has to be looked for. O(n), parallel, some 20 ns a triangle.
/// [simulation of simplicity: Edelsbrunner, Muecke 1990]
int coveringNumber(std::span<const Vec3> vertices, const std::vector<Triangle>& triangles);

}  // namespace polestar
