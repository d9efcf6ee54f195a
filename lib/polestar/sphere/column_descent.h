#pragma once
// Sphere maps that are chosen for what they do to the solid below: flip-free descent of an energy that every
// triangle of the surface contributes for its whole column of cells.

#include <array>
#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/types.h"

namespace polestar {

/// What one triangle (p_0, p_1, p_2) on the sphere adds to the energy, D = det[p_0, p_1, p_2]:
///
///     (constant + sum_k edge_k |p_(k+1) - p_(k+2)|^2) / D^(2/3) + logWeight (ln D + logOffset)^2,
///
/// infinite for D <= 0. The distortion of a cone or prism of cells that have the three directions as corners,
/// at fixed radii, has this form (map/balanced.h); so has MIPS on the sphere but for the exponent.
struct ColumnEnergy {
  double constant = 0;
  std::array<double, 3> edge{};  ///< opposite to corner k; may be negative, the sum above may not
  double logWeight = 0, logOffset = 0;
};

struct ColumnDescentResult {
  int iterations = 0;
  double before = 0, after = 0;  ///< the energy
  double remaining = 0;          ///< the displacement that is still missing, about, in radians
};

/// Moves `directions`, unit vectors without a flip, downhill by at most `maxIterations` steps of
/// preconditioned L-BFGS, none of which makes a flip; stops early where no direction is expected to move by
/// more than `tolerance` radians. Should rounding leave a flip (exact predicates), nothing is changed and
/// `after` is `before`. Same bytes for any number of threads. Cost: one sparse factorization, then linear.
/// @throws Error{Errc::usage} when the start has a flip, Error{Errc::notConverged} when the preconditioner
/// cannot be factorized, Error{Errc::cancelled}
ColumnDescentResult descendColumns(const std::vector<Triangle>& triangles,
                                   std::span<const ColumnEnergy> energies, std::vector<Vec3>& directions,
                                   int maxIterations, double tolerance, const Context& context);

}  // namespace polestar
