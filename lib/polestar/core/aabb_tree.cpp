#include <algorithm>
#include <numeric>

#include "polestar/core/detail/aabb_tree.h"

namespace polestar::detail {

AabbTree::AabbTree(const std::vector<Bounds>& items) : order_(items.size()) {
  if (items.empty()) return;
  std::iota(order_.begin(), order_.end(), 0u);
  std::vector<Vec3> centers(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) centers[i] = 0.5 * (items[i].min + items[i].max);

  struct Task {
    std::uint32_t node, begin, end;
  };
  nodes_.reserve(2 * items.size() / kLeafSize + 2);
  nodes_.emplace_back();
  std::vector<Task> tasks{{0, 0, static_cast<std::uint32_t>(items.size())}};
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    Bounds bounds, spread;
    for (std::uint32_t i = task.begin; i < task.end; ++i) {
      bounds.include(items[order_[i]]);
      spread.include(centers[order_[i]]);
    }
    nodes_[task.node].bounds = bounds;
    if (task.end - task.begin <= kLeafSize) {
      nodes_[task.node].first = task.begin;
      nodes_[task.node].count = task.end - task.begin;
      continue;
    }
    // Halve along the longest side of the centers' box; ties by index keep the tree the same everywhere.
    int axis;
    (spread.max - spread.min).maxCoeff(&axis);
    const std::uint32_t middle = task.begin + (task.end - task.begin) / 2;
    std::nth_element(order_.begin() + task.begin, order_.begin() + middle, order_.begin() + task.end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double x = centers[a][axis], y = centers[b][axis];
                       return x < y || (x == y && a < b);
                     });
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    nodes_[task.node].first = child;
    nodes_.emplace_back();
    nodes_.emplace_back();
    tasks.push_back({child + 1, middle, task.end});
    tasks.push_back({child, task.begin, middle});
  }
}

}  // namespace polestar::detail
