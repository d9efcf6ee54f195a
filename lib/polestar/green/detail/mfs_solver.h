#pragma once
// Green's function by the method of fundamental solutions, in both modes of MfsOptions.

#include "polestar/core/context.h"
#include "polestar/green/green_function.h"

namespace polestar::detail {

struct MfsSolution {
  PointSources sources;
  MfsSummary summary;
  double residual = 0;  ///< of the equation, relative
};

/// Charges for a mesh around the origin, star-shaped about it, its farthest vertex at distance 1.
/// @throws Error{Errc::usage} when the matrix would exceed `options.memoryLimit`, Error{Errc::notConverged}
/// when the decomposition fails, Error{Errc::cancelled}.
MfsSolution solveMfs(const TriMesh& mesh, const MfsOptions& options, const Context& context);

/// The same with everything that solveGreen measures.
GreenFunction solveGreenByCharges(const StarShape& shape, const MfsOptions& options, const Context& context);

}  // namespace polestar::detail
