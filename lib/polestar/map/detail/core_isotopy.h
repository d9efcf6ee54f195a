#pragma once
// A_R: from the boundary parameters at the surface to a rotation at the center.

#include <span>
#include <vector>

#include "polestar/chart/foliation.h"

namespace polestar::detail {

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
