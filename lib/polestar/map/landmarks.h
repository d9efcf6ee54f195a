#pragma once
// Landmarks: places on one solid that belong to places on another. From them, the motion of the ball that
// brings the two into line: a rotation and a Moebius transformation as far as these go, and from there a
// smooth flow of the sphere that meets what is left. [docs/method.md, "From ball to ball"]

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/map/ball_motion.h"

namespace polestar {

/// Directions from the center of the ball, any length but zero.
struct LandmarkPair {
  Vec3 from, to;
  double weight = 1;  ///< positive; only ratios count
};

struct LandmarkFit {
  BallMotion motion;           ///< brings every `from` close to its `to`
  std::vector<double> angles;  ///< what is left of each pair, radians
  double rms = 0, worst = 0;   ///< of these; the mean is weighted
  bool rotationOnly = false;   ///< fewer than three pairs say no more
};

/// Weighted least squares of the chord lengths by Ceres: a rotation for one or two pairs, with a Moebius part
/// for more (six parameters; three pairs are met exactly up to a weak pull towards the rotation). Starts: the
/// best rotation, and this after each of the 24 rotations of a cube. Independent of the order of the pairs up
/// to rounding. Milliseconds.
/// @throws Error{Errc::usage} without pairs, for a direction that is zero or no number, for a weight that is
/// not positive, for pairs that contradict each other (the message names them), and when no motion comes
/// near: then the pairs are mixed up, or mirrored, which is said where mirroring mends it.
LandmarkFit fitLandmarks(std::span<const LandmarkPair> pairs);

struct MatchOptions {
  /// What counts as met, radians. Of pairs that are met closer than this by fitLandmarks nothing is refined.
  double tolerance = 1e-3;
  /// Whether there is a refinement at all.
  bool refine = true;
  /// The pairs are samples of a map, some hundred, rather than places that somebody named: what contradicts
  /// is averaged, however far it is off, and nothing that is left is an error or a failure.
  bool samples = false;
  double coreRadius = 0.25;  ///< within it the motion is a rotation in the end, (0, 1)

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// The motion that landmarks ask for, as good as it could be had.
struct LandmarkMatch {
  std::shared_ptr<const VolumeMap> motion;  ///< a BallMotion, or a ShellMap where `refined`
  Mat3 rotation = Mat3::Identity();         ///< what it does in the middle of the core
  bool refined = false;
  std::vector<double> angles;    ///< what is left of each pair, radians
  double rms = 0, worst = 0;     ///< of these; the mean is weighted
  bool rotationOnly = false;     ///< fewer than three pairs, and a rotation meets them
  double largestDilatation = 1;  ///< sigma_1 / sigma_2 on the sphere where it is sheared most
  std::string stalled;           ///< not empty: why pairs are left that are not met; one to one all the same
};

/// fitLandmarks, and where that leaves more than `tolerance`, a table of the sphere (ShellMap) that starts
/// from the Moebius motion and flows to where the pairs are met: in steps, each by the field of angular
/// velocities of least bending, integral of |laplacian omega|^2, that moves the pairs straight towards their
/// targets, whatever the spin about them [Wahba 1981, spherical thin-plate splines; Glaunes et al. 2004 for
/// flows that match landmarks on the sphere]. No accepted step has a flipped triangle, by exact predicates,
/// nor a table that ShellMap's proof refuses; where no step is short enough, the last one stands and
/// `stalled` says why. Displacements bend like thin plates, so that landmarks leave no spikes.
///
/// The table has 10,242 vertices, 40,962 where pairs are closer than 6 degrees; pairs closer than its edges
/// (2 and 1 degrees) share their motion. Turning all pairs turns the result but for the table's orientation.
/// Cost: O(vertices pairs + pairs^3) a step, on two cores 0.05 s in all for 50 pairs, 1 s for 600.
/// @throws what fitLandmarks throws, for `samples` only what no pair could be; Error{Errc::cancelled}
LandmarkMatch matchLandmarks(std::span<const LandmarkPair> pairs, const MatchOptions& options = {},
                             const Context& context = Context::quiet());

}  // namespace polestar
