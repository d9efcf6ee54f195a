#pragma once
// Points that share a leaf of a tree are worked on together.

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/types.h"

namespace polestar::detail {

/// Points worth a thread of their own.
constexpr std::size_t kPointBlock = 256;

/// Calls body(begin, end) for blocks of points, in parallel when there is more than one.
template <class Body>
void forPointBlocks(std::size_t count, const Context& context, Body&& body) {
  if (count <= kPointBlock) {
    context.throwIfCancelled();
    if (count > 0) body(std::size_t{0}, count);
  } else {
    parallelChunks(count, kPointBlock, context, body);
  }
}

/// Calls visit(leaf, indices, points) once for each leaf that holds some of points begin .. end - 1;
/// `indices` says which these are, ascending. `locate(point)` names the leaf. Serial; the order of calls
/// depends on nothing but the points.
template <class Locate, class Visit>
void visitLeafGroups(std::span<const Vec3> points, std::size_t begin, std::size_t end, Locate&& locate,
                     Visit&& visit) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> leafOf(end - begin);
  for (std::size_t i = begin; i < end; ++i)
    leafOf[i - begin] = {locate(points[i]), static_cast<std::uint32_t>(i)};
  std::sort(leafOf.begin(), leafOf.end());
  std::vector<std::uint32_t> indices;
  std::vector<Vec3> group;
  for (std::size_t i = 0; i < leafOf.size();) {
    const std::uint32_t leaf = leafOf[i].first;
    indices.clear();
    group.clear();
    for (; i < leafOf.size() && leafOf[i].first == leaf; ++i) {
      indices.push_back(leafOf[i].second);
      group.push_back(points[leafOf[i].second]);
    }
    visit(leaf, std::span<const std::uint32_t>(indices), std::span<const Vec3>(group));
  }
}

}  // namespace polestar::detail
