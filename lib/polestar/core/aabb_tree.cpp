#include <algorithm>
#include <numeric>
#include <unordered_map>

#include <tbb/parallel_invoke.h>

#include "polestar/core/detail/aabb_tree.h"
#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

/// Items below which a subtree is built by one thread.
constexpr std::uint32_t kGrain = 8192;

}  // namespace

class AabbTree::Builder {
 public:
  Builder(AabbTree& tree, const std::vector<Bounds>& items) : tree_(tree), items_(items) {
    centers_.resize(items.size());
    parallelChunks(items.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) centers_[i] = 0.5 * (items[i].min + items[i].max);
    });
    const auto count = static_cast<std::uint32_t>(items.size());
    tree_.nodes_.resize(1 + descendants(count));
    build(0, 1, 0, count);
  }

 private:
  // Nodes below one that holds `count` items: where everything goes is known beforehand, so that threads
  // cannot change it.
  std::uint32_t descendants(std::uint32_t count) {
    if (count <= kLeafSize) return 0;
    if (const auto known = descendants_.find(count); known != descendants_.end()) return known->second;
    const std::uint32_t sum = 2 + descendants(count / 2) + descendants(count - count / 2);
    return descendants_[count] = sum;
  }
  std::uint32_t knownDescendants(std::uint32_t count) const {
    return count <= kLeafSize ? 0 : descendants_.at(count);
  }

  // `next`: the first free node for its descendants.
  void build(std::uint32_t node, std::uint32_t next, std::uint32_t begin, std::uint32_t end) const {
    std::vector<std::uint32_t>& order = tree_.order_;
    Bounds bounds, spread;
    for (std::uint32_t i = begin; i < end; ++i) {
      bounds.include(items_[order[i]]);
      spread.include(centers_[order[i]]);
    }
    tree_.nodes_[node].bounds = bounds;
    const std::uint32_t count = end - begin;
    if (count <= kLeafSize) {
      tree_.nodes_[node].first = begin;
      tree_.nodes_[node].count = count;
      return;
    }
    // Halve along the longest side of the centers' box; ties by index keep the tree the same everywhere.
    int axis;
    (spread.max - spread.min).maxCoeff(&axis);
    const std::uint32_t middle = begin + count / 2;
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double x = centers_[a][axis], y = centers_[b][axis];
                       return x < y || (x == y && a < b);
                     });
    tree_.nodes_[node].first = next;
    const std::uint32_t afterLeft = next + 2 + knownDescendants(count / 2);
    const auto left = [&] { build(next, next + 2, begin, middle); };
    const auto right = [&] { build(next + 1, afterLeft, middle, end); };
    if (count < kGrain) {
      left();
      right();
    } else {
      tbb::parallel_invoke(left, right);
    }
  }

  AabbTree& tree_;
  const std::vector<Bounds>& items_;
  std::vector<Vec3> centers_;
  std::unordered_map<std::uint32_t, std::uint32_t> descendants_;
};

AabbTree::AabbTree(const std::vector<Bounds>& items) : order_(items.size()) {
  if (items.empty()) return;
  std::iota(order_.begin(), order_.end(), 0u);
  Builder(*this, items);
}

}  // namespace polestar::detail
