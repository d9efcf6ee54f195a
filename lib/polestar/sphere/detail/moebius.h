#pragma once
// Moebius transformations of the sphere: the freedom that a conformal map leaves.

#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// The conformal map of the unit ball that takes 0 to `shift` and keeps the directions +-shift, applied to
/// points of the sphere; |shift| < 1.
void moebiusTranslate(std::span<Vec3> points, const Vec3& shift);

/// Moves the points by the (up to rotation) only Moebius transformation that brings sum_i share_i s_i to 0.
///
/// Shares are positive and sum to 1; none may reach a half. Newton's method with a line search, 5-10 passes
/// over the points. Returns |sum_i share_i s_i| at the end, about 1e-16. [Baden, Crane, Kazhdan 2018,
/// algorithm 1]
double centerByMoebius(std::span<Vec3> points, std::span<const double> shares);

}  // namespace polestar::detail
