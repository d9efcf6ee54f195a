#pragma once
// Which vertices are the same point.

#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// For each vertex the first one (in file order) with exactly its coordinates. Cost O(n).
std::vector<std::int32_t> weldEqual(std::span<const Vec3> vertices);

/// For each of `candidates`, the first candidate of its cluster: clusters are the connected components of
/// "not farther apart than `tolerance`", so the outcome does not hang on where a grid's cells happen to lie.
/// In places so crowded that a cell of that size holds more than 64 candidates the whole cell is one cluster,
/// which keeps the cost at O(n log n).
std::vector<std::int32_t> weldNear(std::span<const Vec3> vertices, std::span<const std::int32_t> candidates,
                                   double tolerance);

}  // namespace polestar::detail
