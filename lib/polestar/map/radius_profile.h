#pragma once
// The radius of the ball map as a function of R: f = s(R) A_R(omega). s leaves the iso-surfaces of G and the
// field lines where they are and only says how densely they follow one another in the ball.
//
// R itself crowds the far parts of elongated solids towards 1; with s^3 the share of the volume inside, cells
// of the ball hold equal volumes on average. docs/method.md compares the choices.

#include <array>
#include <span>
#include <vector>

#include "polestar/chart/foliation.h"

namespace polestar {

enum class RadiusKind {
  green,    ///< s = R = 1 / (1 + rho G), the paper's up to its units
  volume,   ///< s^3 = share of the solid's volume within the level of R
  mixed,    ///< the mean of the two
  balanced  ///< least distortion of cells (map/balanced.h)
};

inline constexpr std::array kRadiusKinds{RadiusKind::green, RadiusKind::volume, RadiusKind::mixed,
                                         RadiusKind::balanced};

/// "green", "volume", "mixed" or "balanced".
const char* toString(RadiusKind kind);

/// s: [0, 1] -> [0, 1], s(0) = 0, s(1) = 1, s' > 0 and continuous. Linear up to the first knot, so that the
/// map is as smooth at the center as with s = R; then monotone cubics.
class RadiusProfile {
 public:
  using Knot = std::array<double, 2>;  ///< R, s

  /// s = R.
  RadiusProfile() = default;

  /// Through `knots`, both numbers strictly rising from above 0 to (1, 1); at least two. The first s is
  /// lowered where the line from 0 to it would be too steep to go on monotonously.
  /// @throws Error{Errc::usage} for knots that are not like this
  RadiusProfile(RadiusKind kind, std::vector<Knot> knots);

  RadiusKind kind() const { return kind_; }
  /// Empty for s = R. What a file needs to make the same profile again.
  std::span<const Knot> knots() const { return knots_; }

  double value(double ballRadius) const;
  double derivative(double ballRadius) const;
  /// R with value(R) = s, for s in [0, 1].
  double inverse(double s) const;

 private:
  std::size_t segmentOf(double ballRadius) const;

  RadiusKind kind_ = RadiusKind::green;
  std::vector<Knot> knots_;
  std::vector<double> slopes_;  ///< at the knots
};

/// The profile of kind green, volume or mixed. The volumes are those of the foliation's layers.
/// @throws Error{Errc::usage} for balanced, which needs the sphere map
RadiusProfile radiusProfile(RadiusKind kind, const Foliation& foliation);

/// Signed volume of the foliation's layers inside each level, from the surface (all of it) inward; inner
/// units, cubed.
std::vector<double> volumesWithin(const Foliation& foliation);

}  // namespace polestar
