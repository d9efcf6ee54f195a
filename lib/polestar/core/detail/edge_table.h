#pragma once
// The undirected edges of a triangle mesh and which triangle sides lie on them.

#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// Side k of triangle t, numbered 3 t + k, runs from corner k to corner k + 1.
///
/// Indices must be in range; triangles may repeat a vertex. Edges are ordered by their smaller and then by
/// their larger vertex, sides on an edge by number. Cost O(n).
class EdgeTable {
 public:
  EdgeTable(std::span<const Triangle> triangles, std::size_t vertexCount);

  std::size_t size() const { return ends_.size(); }
  /// Smaller vertex first.
  const std::array<std::int32_t, 2>& ends(std::size_t edge) const { return ends_[edge]; }
  std::span<const std::int32_t> sides(std::size_t edge) const {
    return {sides_.data() + first_[edge], static_cast<std::size_t>(first_[edge + 1] - first_[edge])};
  }
  std::int32_t edgeOf(std::size_t side) const { return edgeOf_[side]; }
  /// Whether the side runs from the edge's smaller vertex to its larger one.
  bool forward(std::size_t side) const { return forward_[side] != 0; }

 private:
  std::vector<std::array<std::int32_t, 2>> ends_;
  std::vector<std::int32_t> sides_, first_, edgeOf_;
  std::vector<char> forward_;
};

/// Disjoint sets that are named by their smallest member.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    for (std::size_t i = 0; i < count; ++i) parent_[i] = static_cast<std::int32_t>(i);
  }
  std::int32_t find(std::int32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(std::int32_t a, std::int32_t b) {
    a = find(a);
    b = find(b);
    if (a < b) {
      parent_[b] = a;
    } else {
      parent_[a] = b;
    }
  }

 private:
  std::vector<std::int32_t> parent_;
};

}  // namespace polestar::detail
