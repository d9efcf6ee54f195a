#pragma once
// The layer solver as a whole: solve, look where the boundary error sits, split there, solve again.

#include <vector>

#include "polestar/core/context.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/green/green_function.h"

namespace polestar::detail {

struct SolvedLayer {
  TriMesh mesh;                                   ///< inner frame; begins with the vertices of the shape
  std::shared_ptr<const AlignedSurface> surface;  ///< of `mesh`
  std::vector<double> density;
  GreenRecord record;
};

/// See solveGreen. @throws Error{Errc::notConverged}, Error{Errc::cancelled}
SolvedLayer solveAdaptively(const StarShape& shape, const GreenOptions& options, Context& context);

}  // namespace polestar::detail
