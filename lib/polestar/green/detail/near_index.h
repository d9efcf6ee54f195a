#pragma once
// Which triangles may be near a point: an octree whose leaves list the near spheres that reach into them.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/green/detail/near_field.h"
#include "polestar/green/detail/octree.h"

namespace polestar::detail {

class NearIndex {
 public:
  /// Over the cube; points outside it count as its boundary's. O(n log n), in parallel.
  NearIndex(const NearField& field, const Cube& cube, const Context& context);

  /// The leaf around a point. O(depth).
  std::uint32_t locate(const Vec3& point) const;
  /// Triangles whose near sphere meets the leaf, ascending.
  std::span<const std::uint32_t> candidates(std::uint32_t leaf) const {
    return std::span(candidates_).subspan(boxes_[leaf].begin, boxes_[leaf].end - boxes_[leaf].begin);
  }

 private:
  struct Box {
    std::array<std::uint32_t, 3> cell{};
    std::uint32_t firstChild = 0;  // 0: a leaf
    std::uint32_t begin = 0, end = 0;
  };
  Cube cube_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> candidates_;
};

}  // namespace polestar::detail
