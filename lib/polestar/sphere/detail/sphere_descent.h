#pragma once
// Minimizes an energy of points that live on the unit sphere: preconditioned L-BFGS on the product of
// spheres.

#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/types.h"

namespace polestar::detail {

/// What the descent needs to know of a function of n unit vectors.
class SphereEnergy {
 public:
  virtual ~SphereEnergy() = default;

  /// The energy; infinite where a point set is not allowed (a flip under a barrier). A gradient is written
  /// when `gradient` is not empty and the value is finite; its normal part does not matter.
  virtual double evaluate(std::span<const Vec3> points, std::span<Vec3> gradient) const = 0;

  /// out = an approximate inverse Hessian (symmetric, positive definite) applied to `gradient`.
  virtual void precondition(std::span<const Vec3> gradient, std::span<Vec3> out) const = 0;
};

struct DescentOptions {
  int maxIterations = 300;
  /// Done when the preconditioned gradient, about the displacement that is still missing, is below this
  /// everywhere (radians).
  double tolerance = 1e-10;
};

struct DescentResult {
  int iterations = 0;
  int evaluations = 0;  ///< of the energy, line searches included
  double energy = 0;
  double remaining = 0;    ///< largest entry of the last preconditioned gradient
  bool converged = false;  ///< to the tolerance, or to 1e-6 where rounding allowed no more
};

/// Moves `points` downhill in place; the energy must be finite at the start and never rises beyond rounding.
///
/// Near the minimum the energy stops telling two points apart (a step of 1e-8 changes it by 1e-16), so steps
/// are then judged by the slope [Hager, Zhang 2005, "approximate Wolfe condition"].
/// @throws Error{Errc::cancelled}
DescentResult descendOnSpheres(const SphereEnergy& energy, std::vector<Vec3>& points,
                               const DescentOptions& options, const Context& context);

}  // namespace polestar::detail
