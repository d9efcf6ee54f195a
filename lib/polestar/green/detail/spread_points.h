#pragma once
// Well-spread subsets of points.

#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// Indices of `count` of the points, each as far from those before it as can be, distances measured in the
/// spacing that is wanted at the new point. Begins with the point farthest from the origin. Ties, up to
/// rounding, go to the lower index, so that moved and turned copies get the same subset. O(points count).
/// [Gonzalez 1985]
std::vector<std::size_t> spreadPoints(std::span<const Vec3> points, std::span<const double> spacing,
                                      std::size_t count);

}  // namespace polestar::detail
