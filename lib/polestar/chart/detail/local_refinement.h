#pragma once
// Where field lines are right and cells between them still inverted the surface is too coarse for the bend of
// the map: at sharp edges and corners one flat triangle becomes a curved one below.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "polestar/chart/detail/line_tracing.h"

namespace polestar::detail {

struct LocalRefinement {
  std::size_t vertices = 0;  ///< that were added
  std::vector<std::int32_t>
      failed;  ///< those that could not be traced; they have the mean of their neighbours
};

/// Cuts the triangles above bad cells at their longest edges and follows the lines of the midpoints, round by
/// round as long as that takes area away from bad columns and few triangles are concerned.
/// @throws Error{Errc::cancelled}
LocalRefinement refineAboveBadCells(GreenChart::Data& data, LineTracing& tracing, Context& context);

}  // namespace polestar::detail
