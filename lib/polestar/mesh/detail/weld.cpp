#include "polestar/mesh/detail/weld.h"

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

#include "polestar/core/detail/edge_table.h"

namespace polestar::detail {
namespace {

std::uint64_t hashOf(const Vec3& v) {
  std::uint64_t hash = 0;
  for (int k = 0; k < 3; ++k) {
    hash ^= std::bit_cast<std::uint64_t>(v[k] + 0.0);  // -0 equals 0
    hash *= 0x9E3779B97F4A7C15u;
    hash ^= hash >> 29;
  }
  return hash ^ (hash >> 32);
}

using Cell = std::array<std::int64_t, 3>;

/// Candidates sorted by grid cell, in cells of the tolerance's size.
class CellGrid {
 public:
  static constexpr std::size_t kCrowded = 64;

  struct Occupied {
    Cell cell;
    std::size_t begin, end;
    Vec3 min, max;  ///< tight box of the cell's points
  };

  CellGrid(std::span<const Vec3> vertices, std::span<const std::int32_t> candidates, double tolerance)
      : vertices_(vertices), tolerance_(tolerance) {
    Vec3 low = vertices[candidates[0]], high = low;
    for (const std::int32_t c : candidates) {
      low = low.cwiseMin(vertices[c]);
      high = high.cwiseMax(vertices[c]);
    }
    // A little larger than the tolerance, lest rounding puts neighbours two cells apart; never so small that
    // cell numbers overflow.
    const double side = std::max(1.001 * tolerance, 1e-15 * (high - low).maxCoeff());
    struct Entry {
      Cell cell;
      std::int32_t rank;
    };
    std::vector<Entry> entries(candidates.size());
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const Vec3 scaled = (vertices[candidates[i]] - low) / side;
      for (int k = 0; k < 3; ++k) entries[i].cell[k] = static_cast<std::int64_t>(scaled[k]);
      entries[i].rank = static_cast<std::int32_t>(i);
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return std::tie(a.cell, a.rank) < std::tie(b.cell, b.rank);
    });
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const Vec3& v = vertices[candidates[entries[i].rank]];
      ranks_.push_back(entries[i].rank);
      points_.push_back(v);
      if (cells_.empty() || cells_.back().cell != entries[i].cell)
        cells_.push_back({entries[i].cell, i, i, v, v});
      Occupied& cell = cells_.back();
      cell.end = i + 1;
      cell.min = cell.min.cwiseMin(v);
      cell.max = cell.max.cwiseMax(v);
    }
  }

  void unite(DisjointSets& sets) const {
    for (const Occupied& here : cells_) {
      uniteWithin(here, sets);
      for (int step = 14; step < 27; ++step) {  // the later half of the 26 neighbours
        const Cell there{here.cell[0] + step / 9 - 1, here.cell[1] + step / 3 % 3 - 1,
                         here.cell[2] + step % 3 - 1};
        const auto found = std::lower_bound(cells_.begin(), cells_.end(), there,
                                            [](const Occupied& o, const Cell& c) { return o.cell < c; });
        if (found != cells_.end() && found->cell == there) uniteAcross(here, *found, sets);
      }
    }
  }

 private:
  bool near(const Vec3& a, const Vec3& b) const { return (a - b).norm() <= tolerance_; }
  static bool crowded(const Occupied& cell) { return cell.end - cell.begin > kCrowded; }

  void uniteWithin(const Occupied& cell, DisjointSets& sets) const {
    for (std::size_t i = cell.begin + 1; i < cell.end; ++i) {
      if (crowded(cell)) sets.unite(ranks_[cell.begin], ranks_[i]);
      for (std::size_t j = cell.begin; j < i && !crowded(cell); ++j) {
        if (near(points_[i], points_[j])) sets.unite(ranks_[i], ranks_[j]);
      }
    }
  }

  void uniteAcross(const Occupied& a, const Occupied& b, DisjointSets& sets) const {
    if (crowded(a) || crowded(b)) {
      const Vec3 gap = (b.min - a.max).cwiseMax(a.min - b.max).cwiseMax(0);
      if (gap.norm() > tolerance_) return;
      if (crowded(a) && crowded(b)) {
        sets.unite(ranks_[a.begin], ranks_[b.begin]);
        return;
      }
    }
    for (std::size_t i = a.begin; i < a.end; ++i) {
      for (std::size_t j = b.begin; j < b.end; ++j) {
        if (near(points_[i], points_[j])) sets.unite(ranks_[i], ranks_[j]);
      }
    }
  }

  std::span<const Vec3> vertices_;
  double tolerance_;
  std::vector<Occupied> cells_;
  std::vector<std::int32_t> ranks_;
  std::vector<Vec3> points_;
};

}  // namespace

std::vector<std::int32_t> weldEqual(std::span<const Vec3> vertices) {
  const std::size_t slots = std::bit_ceil(2 * vertices.size() + 1);
  std::vector<std::int32_t> table(slots, -1), first(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    std::size_t slot = hashOf(vertices[i]) & (slots - 1);
    while (table[slot] >= 0 && vertices[table[slot]] != vertices[i]) slot = (slot + 1) & (slots - 1);
    if (table[slot] < 0) table[slot] = static_cast<std::int32_t>(i);
    first[i] = table[slot];
  }
  return first;
}

std::vector<std::int32_t> weldNear(std::span<const Vec3> vertices, std::span<const std::int32_t> candidates,
                                   double tolerance) {
  std::vector<std::int32_t> first(candidates.size());
  if (candidates.empty()) return first;
  DisjointSets sets(candidates.size());
  CellGrid(vertices, candidates, tolerance).unite(sets);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    first[i] = candidates[sets.find(static_cast<std::int32_t>(i))];
  }
  return first;
}

}  // namespace polestar::detail
