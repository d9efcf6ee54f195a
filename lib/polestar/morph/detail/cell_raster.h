#pragma once
// Which cell of the complex holds which voxel: the cells are dealt out to the leaves that their boxes meet,
// and scan-converted there. No tree is built, which would cost more than a frame has voxels for.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/chart/foliation.h"

namespace polestar::detail {

/// Index coordinates throughout: voxel centers are the integers.
class CellRaster {
 public:
  static constexpr int kLeafSize = 8;
  using Cell = std::array<std::uint32_t, 4>;
  using Weights = std::array<double, 4>;
  using Gradients = std::array<Vec3, 4>;  ///< of the weights

  /// O(cells), parallel; the same for any number of threads. `ball` and `nodes` have to stay.
  CellRaster(const Foliation& ball, std::span<const Vec3> nodes);

  /// Calls visit(place, cell, weights, gradients) for every voxel of the leaf at `first` (multiples of 8)
  /// that a positive cell holds; place is 64 x + 8 y + z. Of several cells that touch a voxel the first has
  /// it.
  template <class Visit>
  void visitLeaf(const std::array<int, 3>& first, Visit&& visit) const;

 private:
  // Far above rounding in barycentric weights, far below what a voxel shows.
  static constexpr double kSlack = 1e-9;

  std::span<const std::uint32_t> cellsOf(const std::array<int, 3>& first) const;

  const Foliation& ball_;
  std::span<const Vec3> nodes_;
  std::array<int, 3> lowest_{}, leaves_{};  ///< in leaves
  std::vector<std::uint32_t> begin_, cells_;
};

template <class Visit>
void CellRaster::visitLeaf(const std::array<int, 3>& first, Visit&& visit) const {
  std::array<bool, kLeafSize * kLeafSize * kLeafSize> taken{};
  for (const std::uint32_t id : cellsOf(first)) {
    const Cell cell = ball_.cell(id);
    const Vec3& a = nodes_[cell[0]];
    const std::array<Vec3, 3> edge{nodes_[cell[1]] - a, nodes_[cell[2]] - a, nodes_[cell[3]] - a};
    const Vec3 low = a + edge[0].cwiseMin(edge[1]).cwiseMin(edge[2]).cwiseMin(0.0),
               high = a + edge[0].cwiseMax(edge[1]).cwiseMax(edge[2]).cwiseMax(0.0);
    std::array<int, 3> begin{}, end{};
    for (int k = 0; k < 3; ++k) {
      begin[k] = std::max(0, static_cast<int>(std::ceil(low[k] - kSlack)) - first[k]);
      end[k] = std::min(kLeafSize, static_cast<int>(std::floor(high[k] + kSlack)) + 1 - first[k]);
    }
    if (begin[0] >= end[0] || begin[1] >= end[1] || begin[2] >= end[2]) continue;
    const Vec3 across = edge[1].cross(edge[2]);
    const double volume = edge[0].dot(across);
    if (!(volume > 0)) continue;
    Gradients gradient{Vec3::Zero(), across / volume, edge[2].cross(edge[0]) / volume,
                       edge[0].cross(edge[1]) / volume};
    gradient[0] = -(gradient[1] + gradient[2] + gradient[3]);
    for (int x = begin[0]; x < end[0]; ++x) {
      for (int y = begin[1]; y < end[1]; ++y) {
        const Vec3 row = Vec3(first[0] + x, first[1] + y, first[2]) - a;
        const std::array<double, 3> start{gradient[1].dot(row), gradient[2].dot(row), gradient[3].dot(row)};
        for (int z = begin[2]; z < end[2]; ++z) {
          Weights w{0, start[0] + z * gradient[1].z(), start[1] + z * gradient[2].z(),
                    start[2] + z * gradient[3].z()};
          w[0] = 1 - w[1] - w[2] - w[3];
          if (*std::min_element(w.begin(), w.end()) < -kSlack) continue;
          const int place = (x * kLeafSize + y) * kLeafSize + z;
          if (taken[place]) continue;
          taken[place] = true;
          visit(place, cell, w, gradient);
        }
      }
    }
  }
}

}  // namespace polestar::detail
