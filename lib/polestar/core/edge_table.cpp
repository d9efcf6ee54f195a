#include "polestar/core/detail/edge_table.h"

#include <algorithm>

namespace polestar::detail {

EdgeTable::EdgeTable(std::span<const Triangle> triangles, std::size_t vertexCount) {
  const std::size_t sideCount = 3 * triangles.size();
  edgeOf_.resize(sideCount);
  forward_.resize(sideCount);
  // Sort the sides into buckets by their smaller vertex, then each small bucket by the larger one.
  struct Entry {
    std::int32_t larger, side;
    bool operator<(const Entry& other) const {
      return larger != other.larger ? larger < other.larger : side < other.side;
    }
  };
  const auto endsOf = [&](std::size_t side) {
    const Triangle& t = triangles[side / 3];
    return std::array{t[side % 3], t[(side + 1) % 3]};
  };
  std::vector<std::int32_t> bucket(vertexCount + 1, 0);
  for (std::size_t side = 0; side < sideCount; ++side) {
    const auto [a, b] = endsOf(side);
    ++bucket[std::min(a, b) + 1];
    forward_[side] = a < b;
  }
  for (std::size_t v = 0; v < vertexCount; ++v) bucket[v + 1] += bucket[v];
  std::vector<Entry> entries(sideCount);
  std::vector<std::int32_t> filled(bucket.begin(), bucket.end() - 1);
  for (std::size_t side = 0; side < sideCount; ++side) {
    const auto [a, b] = endsOf(side);
    entries[filled[std::min(a, b)]++] = {std::max(a, b), static_cast<std::int32_t>(side)};
  }
  sides_.reserve(sideCount);
  ends_.reserve(sideCount / 2);
  first_.reserve(sideCount / 2 + 1);
  for (std::size_t v = 0; v < vertexCount; ++v) {
    const auto begin = entries.begin() + bucket[v], end = entries.begin() + bucket[v + 1];
    std::sort(begin, end);
    for (auto entry = begin; entry != end; ++entry) {
      if (entry == begin || entry->larger != (entry - 1)->larger) {
        first_.push_back(static_cast<std::int32_t>(sides_.size()));
        ends_.push_back({static_cast<std::int32_t>(v), entry->larger});
      }
      edgeOf_[entry->side] = static_cast<std::int32_t>(ends_.size() - 1);
      sides_.push_back(entry->side);
    }
  }
  first_.push_back(static_cast<std::int32_t>(sides_.size()));
}

}  // namespace polestar::detail
