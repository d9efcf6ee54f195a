#pragma once
// Two solids brought into line without landmarks: the turn under which their radii, seen from their centers,
// agree best, and the motion of the ball that takes the coordinates of the one to those of the other.

#include "polestar/core/context.h"
#include "polestar/map/ball_map.h"
#include "polestar/map/landmarks.h"
#include "polestar/star/star_shape.h"

namespace polestar {

/// Correlations are those of ln r over all directions, r the distance from the center to the surface: 1 for
/// turned and scaled copies, 0 for solids that have nothing to do with each other.
struct Alignment {
  Mat3 rotation = Mat3::Identity();  ///< directions from the first center (world axes) to the second's
  /// Under `rotation`; 0, with no turn, where one of the solids is round or no turn reaches 0.1.
  double correlation = 0;
  double correlationBefore = 0;  ///< as the solids lie
  /// The best turn that differs from `rotation` by more than 20 degrees.
  Mat3 runnerUp = Mat3::Identity();
  double runnerUpCorrelation = 0;
  /// The runner-up is as good for all that radii can say (by 0.02 of the correlation), as for bodies that are
  /// symmetric or nearly round. Of turns that agree to 0.001 the smallest is taken.
  bool ambiguous = false;
};

/// Starts are the principal axes, as they may correspond, and 3,000 turns that are spread evenly over all of
/// them [Alexa 2022, super-Fibonacci spirals]; the best are refined by Ceres. A turned copy comes back to
/// a hundredth of a degree, as far as its center does. 0.15 s on two cores.
/// @throws Error{Errc::cancelled}
Alignment alignSolids(const StarShape& from, const StarShape& to, const Context& context = Context::quiet());

/// The motion of the ball under which points of the two surfaces meet that lie in the same direction from
/// their centers, after `rotation`: matchLandmarks (as samples) of phi_from(q) and phi_to(q') for 252 even
/// directions. 0.13 s on two cores.
/// @throws Error{Errc::usage, Errc::cancelled}
LandmarkMatch alignedMotion(const BallMap& from, const BallMap& to, const Mat3& rotation,
                            const MatchOptions& options = {}, const Context& context = Context::quiet());

}  // namespace polestar
