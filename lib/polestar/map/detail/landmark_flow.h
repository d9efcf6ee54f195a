#pragma once
// From the Moebius motion that comes closest to landmarks on to a table of the sphere that meets them.

#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/landmarks.h"
#include "polestar/map/shell_map.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar::detail {

/// A table that flows. It is one to one at all times, and ShellMap accepts it.
class LandmarkFlow {
 public:
  /// `pairs`: unit vectors, weights about 1. Begins with `motion`, less its Moebius part where that is so
  /// strong that the core could not undo it. `fine`: 40,962 vertices instead of 10,242 where pairs are close.
  LandmarkFlow(std::span<const LandmarkPair> pairs, const BallMotion& motion, bool fine);

  /// Until every pair is met to `tolerance` (radians); returns why it ended before, or nothing. With
  /// `samples`, until nothing is gained any more, which is no failure.
  /// @throws Error{Errc::cancelled}
  std::string run(double tolerance, bool samples, const Context& context);

  const ShellTable& table() const { return table_; }

 private:
  enum class Obstacle { none, fold, core };

  /// Where pair k is now.
  Vec3 image(std::size_t k) const;
  /// What is left of the pairs.
  struct Remaining {
    std::vector<Vec3> now;    ///< where they are
    std::vector<Vec3> ahead;  ///< the ways to their targets, as angular velocities at right angles to `now`
    std::vector<double> angle;
    double farthest = 0;          ///< of the angles
    double longest = 0, rms = 0;  ///< of the ways
  };
  Remaining remaining() const;
  Vec3 wayOf(std::size_t k, std::span<const Vec3> now) const;
  /// Moves every vertex by the field as far as that goes, at most once; how far.
  double advance(std::span<const Vec3> field);
  Obstacle obstacleAt(const ShellTable& moved) const;
  std::string reason(const Remaining& left) const;

  std::vector<LandmarkPair> pairs_;
  ShellTable table_;
  double resolution_;  ///< length of an edge, radians
  std::vector<SphereLocator::Hit> place_;
  Obstacle obstacle_ = Obstacle::none;
};

}  // namespace polestar::detail
