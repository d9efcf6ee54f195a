#pragma once
// For a body without a center: the point that misses the least of the surface, so that the report can say
// what to mend.

#include <vector>

#include "polestar/core/context.h"
#include "polestar/star/detail/half_spaces.h"

namespace polestar::detail {

/// The point of the working frame with the smallest area of faces behind it, as found from a grid over the
/// box and from `starts` by pattern search; on a sample of the faces when there are many. A local optimum:
/// the area behind a point has many. Deterministic.
Vec3 leastBadCenter(const TriMesh& mesh, const Frame& frame, const HalfSpaces& halfSpaces,
                    const std::vector<Vec3>& starts, const Context& context);

}  // namespace polestar::detail
