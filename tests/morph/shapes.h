#pragma once
// Shapes that the tests of a stage share, each mapped once.

#include "polestar/morph/morph_complex.h"

namespace polestar::testing {

/// Three smooth lobes of radius about 1, and a longish body with a waist around (3, 1, 0).
const BallMap& lobes();
const BallMap& waist();

/// lobes(), every vertex moved by x -> scale * turn * x + shift.
BallMap movedLobes(const Mat3& turn, double scale, const Vec3& shift);

/// Fine enough for tests: two hundredths of a unit.
MorphOptions coarse();

/// A turn of 100 degrees about a skew axis.
Mat3 skewTurn();

}  // namespace polestar::testing
