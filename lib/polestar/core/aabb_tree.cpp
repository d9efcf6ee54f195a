#include <algorithm>
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
    entries_.resize(items.size());
    parallelChunks(items.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        entries_[i] = {0.5 * (items[i].min + items[i].max), static_cast<std::uint32_t>(i)};
    });
    const auto count = static_cast<std::uint32_t>(items.size());
    tree_.nodes_.resize(1 + descendants(count));
    build(0, 1, 0, count);
    tree_.order_.resize(items.size());
    parallelChunks(items.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) tree_.order_[i] = entries_[i].item;
    });
  }

 private:
  // Centers lie in the order of the tree to be, so that every pass goes through memory in order.
  struct Entry {
    Vec3 center;
    std::uint32_t item;
  };

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
  void build(std::uint32_t node, std::uint32_t next, std::uint32_t begin, std::uint32_t end) {
    const std::uint32_t count = end - begin;
    if (count <= kLeafSize) {
      Bounds bounds;
      for (std::uint32_t i = begin; i < end; ++i) bounds.include(items_[entries_[i].item]);
      tree_.nodes_[node] = {bounds, begin, count};
      return;
    }
    Bounds spread;
    for (std::uint32_t i = begin; i < end; ++i) spread.include(entries_[i].center);
    // Halve along the longest side of the centers' box; ties by index keep the tree the same everywhere.
    int axis;
    (spread.max - spread.min).maxCoeff(&axis);
    const std::uint32_t middle = begin + count / 2;
    std::nth_element(entries_.begin() + begin, entries_.begin() + middle, entries_.begin() + end,
                     [axis](const Entry& a, const Entry& b) {
                       const double x = a.center[axis], y = b.center[axis];
                       return x < y || (x == y && a.item < b.item);
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
    Bounds bounds = tree_.nodes_[next].bounds;
    bounds.include(tree_.nodes_[next + 1].bounds);
    tree_.nodes_[node].bounds = bounds;
  }

  AabbTree& tree_;
  const std::vector<Bounds>& items_;
  std::vector<Entry> entries_;
  std::unordered_map<std::uint32_t, std::uint32_t> descendants_;
};

AabbTree::AabbTree(const std::vector<Bounds>& items) {
  if (!items.empty()) Builder(*this, items);
}

}  // namespace polestar::detail
