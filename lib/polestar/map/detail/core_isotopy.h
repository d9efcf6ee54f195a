#pragma once
// A_R: from the boundary parameters at the surface to a rotation at the center.

#include <span>
#include <vector>

#include "polestar/chart/foliation.h"

namespace polestar::detail {

/// How much of A is in A_R: 0 up to coreRadius / 4, 1 from coreRadius on, with two continuous derivatives;
/// even in ln R, because what turns is seen from the center, and grids resolve the outer part of the core
/// better than the inner. And its derivative by R. `coreRadius` > 0.
double coreShare(double ballRadius, double coreRadius);
double coreShareSlope(double ballRadius, double coreRadius);

/// The family A_R on the vertices' directions. Equivariant: turning omega and phi turns the result.
class CoreIsotopy {
 public:
  /// `coreRadius` 0: A_R = A for all R.
  CoreIsotopy(std::span<const Vec3> omega, std::span<const Vec3> phi, std::span<const double> weight,
              double coreRadius);

  /// A_R of a direction omega whose boundary parameter A(omega) is phi. Unit vector.
  Vec3 direction(double ballRadius, const Vec3& omega, const Vec3& phi) const;
  const Mat3& rotation() const { return rotation_; }

 private:
  double coreRadius_;
  Mat3 rotation_;  ///< least-squares, takes omega to phi
};

}  // namespace polestar::detail
