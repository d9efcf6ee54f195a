#pragma once
// Which way to turn a lattice.

#include <functional>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/types.h"

namespace polestar::detail {

/// The 24 rotations that carry a cubic lattice to itself, the identity first.
const std::vector<Mat3>& latticeSymmetries();

/// About `count` rotations, spread evenly over those that a lattice tells apart (each is the one of the 24
/// that mean the same lattice that turns the least).
std::vector<Mat3> spreadLattices(int count);

/// Of `axes` after each of the symmetries, those that turn the least.
Mat3 nearestToIdentity(const Mat3& axes, const std::vector<Mat3>& symmetries);

/// Tries all `candidates`, then climbs from the four best of them by small turns until half a degree changes
/// nothing: where these climbs end, the best one first. Deterministic; parallel over rotations, so `score`
/// must be thread-safe.
std::vector<Mat3> bestAxes(const std::vector<Mat3>& candidates,
                           const std::function<double(const Mat3&)>& score, const Context& context);

}  // namespace polestar::detail
