#pragma once
// Landmarks: places on one solid that belong to places on another. From them, the motion of the ball that
// brings the two into line.

#include <span>
#include <string>
#include <vector>

#include "polestar/map/ball_motion.h"

namespace polestar {

/// Directions from the center of the ball, any length but zero.
struct LandmarkPair {
  Vec3 from, to;
};

struct LandmarkFit {
  BallMotion motion;           ///< brings every `from` close to its `to`
  std::vector<double> angles;  ///< what is left of each pair, radians
  double rms = 0, worst = 0;   ///< of these
  bool rotationOnly = false;   ///< fewer than three pairs say no more
};

/// Least squares of the chord lengths by Ceres, from many starts: a rotation for one or two pairs, with a
/// Moebius part for more (six parameters; three pairs are met exactly up to a weak pull towards the
/// rotation). Independent of the order of the pairs up to rounding. Milliseconds.
/// @throws Error{Errc::usage} without pairs, for a direction that is zero or no number, for pairs that
/// contradict each other (the message names them), and when no motion comes near: then the pairs are mixed
/// up, or mirrored, which is said where mirroring mends it.
LandmarkFit fitLandmarks(std::span<const LandmarkPair> pairs);

}  // namespace polestar
