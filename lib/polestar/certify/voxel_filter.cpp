#include "polestar/certify/voxel_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace polestar {
namespace {

constexpr int kRings = 4, kSweeps = 24, kBorder = 2;

class Filter {
 public:
  explicit Filter(const VoxelBlock& block)
      : block_(block), n_(block.size), rest_(block.rest.begin(), block.rest.end()) {}

  MendedBlock run() {
    const CellQuality before = judge();
    bool done = before.invertedDeep == 0;
    std::vector<char> bad(rest_.size(), 0);
    for (int rings = 1; rings <= kRings && !done; ++rings) {
      rest_.assign(block_.rest.begin(), block_.rest.end());
      for (int sweep = 0; sweep < kSweeps && !done; ++sweep) {
        markBadCells(bad);  // those that invert on the way join in
        smooth(weights(bad, rings));
        const CellQuality now = judge();
        if (now.inverted > before.inverted) continue;
        done = now.invertedDeep == 0;
      }
    }
    if (!done) rest_.assign(block_.rest.begin(), block_.rest.end());
    return mendedBlock(block_, std::move(rest_));
  }

 private:
  std::size_t at(int i, int j, int k) const { return (static_cast<std::size_t>(i) * n_ + j) * n_ + k; }
  template <class Visit>
  void visit(int from, int to, Visit&& visit) const {
    for (int i = from; i < to; ++i) {
      for (int j = from; j < to; ++j) {
        for (int k = from; k < to; ++k) visit(i, j, k);
      }
    }
  }

  CellQuality judge() const {
    VoxelBlock block = block_;
    block.rest = rest_;
    return judgeCells(block);
  }

  // Corners of deep inverted cells, added to those that are marked.
  void markBadCells(std::vector<char>& bad) const {
    VoxelBlock block = block_;
    block.rest = rest_;
    for (const auto& [i, j, k] : deepInvertedCells(block)) {
      for (int c = 0; c < 8; ++c) bad[at(i + (c >> 2), j + (c >> 1 & 1), k + (c & 1))] = 1;
    }
  }

  // 1 at the marked samples, falling to 0 beyond `rings` voxels (of the largest coordinate difference).
  std::vector<float> weights(const std::vector<char>& bad, int rings) const {
    std::vector<float> weight(rest_.size(), 0);
    visit(0, n_, [&](int i, int j, int k) {
      if (!bad[at(i, j, k)]) return;
      for (int a = -rings; a <= rings; ++a) {
        for (int b = -rings; b <= rings; ++b) {
          for (int c = -rings; c <= rings; ++c) {
            const int x = i + a, y = j + b, z = k + c;
            if (std::min({x, y, z}) < kBorder || std::max({x, y, z}) >= n_ - kBorder) continue;
            const int distance = std::max({std::abs(a), std::abs(b), std::abs(c)});
            float& w = weight[at(x, y, z)];
            w = std::max(w, 1 - static_cast<float>(distance) / static_cast<float>(rings + 1));
          }
        }
      }
    });
    return weight;
  }

  void smooth(const std::vector<float>& weight) {
    const std::vector<Vec3f> before = rest_;
    const std::array<std::size_t, 3> step{at(1, 0, 0), at(0, 1, 0), 1};
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      if (!(weight[i] > 0) || !block_.active[i]) continue;
      Vec3 mean = Vec3::Zero();
      int pairs = 0;  // only both sides of an axis: one alone would pull
      for (const std::size_t s : step) {
        if (!block_.active[i - s] || !block_.active[i + s]) continue;
        mean += 0.5 * (before[i - s].cast<double>() + before[i + s].cast<double>());
        ++pairs;
      }
      const Vec3 old = before[i].cast<double>();
      if (pairs == 0) continue;
      const Vec3 filtered = old + 0.6 * weight[i] * (mean / pairs - old);
      const double radius = block_.rest[i].cast<double>().norm();
      if (!(radius > 0 && filtered.norm() > 0)) continue;
      rest_[i] = (radius / filtered.norm() * filtered).cast<float>();
    }
  }

  const VoxelBlock& block_;
  int n_;
  std::vector<Vec3f> rest_;
};

}  // namespace

MendedBlock filterInvertedCells(const VoxelBlock& block) { return Filter(block).run(); }

}  // namespace polestar
