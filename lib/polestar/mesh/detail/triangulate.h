#pragma once
// Polygons with more than three corners become triangles.

#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// Quads are cut along the diagonal that makes both halves agree best; larger polygons by clipping, in their
/// best-fitting plane, the ear with the largest smallest angle. n - 2 triangles of the polygon's own
/// orientation in any case, also for polygons that cross themselves, so that a closed surface stays closed.
class Triangulator {
 public:
  explicit Triangulator(std::span<const Vec3> vertices) : vertices_(vertices) {}

  /// Appends the triangles of `polygon`, n >= 4 corners. False when clipping has used up the budget of point
  /// tests that one file has (O(n^2) for spirals and combs): a crafted file must not hang its reader.
  bool operator()(std::span<const std::int32_t> polygon, std::vector<Triangle>& triangles);

 private:
  void cutQuad(std::span<const std::int32_t> q, std::vector<Triangle>& triangles) const;
  bool clipEars(std::span<const std::int32_t> polygon, std::vector<Triangle>& triangles);

  std::span<const Vec3> vertices_;
  std::int64_t budget_ = 200'000'000;
};

}  // namespace polestar::detail
