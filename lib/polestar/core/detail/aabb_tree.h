#pragma once
// A static tree of boxes that answers "which boxes contain this point". Serves the near-field search of the
// layer (spheres around triangles) and the location of points in the foliation's tetrahedra.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

struct Bounds {
  Vec3 min = Vec3::Constant(1e300), max = Vec3::Constant(-1e300);

  void include(const Vec3& p) {
    min = min.cwiseMin(p);
    max = max.cwiseMax(p);
  }
  void include(const Bounds& b) {
    min = min.cwiseMin(b.min);
    max = max.cwiseMax(b.max);
  }
  bool contains(const Vec3& p) const {
    return (p.array() >= min.array()).all() && (p.array() <= max.array()).all();
  }
  bool overlaps(const Bounds& b) const {
    return (b.max.array() >= min.array()).all() && (b.min.array() <= max.array()).all();
  }
  /// Distance from p to the box, squared; 0 inside.
  double squaredDistance(const Vec3& p) const {
    return (min - p).cwiseMax(p - max).cwiseMax(0.0).squaredNorm();
  }
};

/// Built once over the boxes of items 0 .. n-1, in O(n log n), in parallel; the same tree for any number of
/// threads.
class AabbTree {
 public:
  AabbTree() = default;
  explicit AabbTree(const std::vector<Bounds>& items);

  /// Calls visit(item) for every item of a leaf whose box contains `p`, in a fixed order, until visit returns
  /// true. The items' own boxes are not tested: the visitor does its exact test anyway.
  template <class Visit>
  bool visitContaining(const Vec3& p, Visit&& visit) const {
    return visitWithin(p, 0, visit);
  }

  /// The same for leaves no farther from `p` than sqrt(squaredRadius).
  template <class Visit>
  bool visitWithin(const Vec3& p, double squaredRadius, Visit&& visit) const {
    return visitWhere([&](const Bounds& bounds) { return bounds.squaredDistance(p) <= squaredRadius; },
                      visit);
  }

  /// The same for leaves whose box meets `box`.
  template <class Visit>
  bool visitOverlapping(const Bounds& box, Visit&& visit) const {
    return visitWhere([&](const Bounds& bounds) { return bounds.overlaps(box); }, visit);
  }

 private:
  template <class Meets, class Visit>
  bool visitWhere(Meets&& meets, Visit&& visit) const {
    if (nodes_.empty()) return false;
    std::uint32_t stack[64];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      if (!meets(node.bounds)) continue;
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
          if (visit(static_cast<std::size_t>(order_[i]))) return true;
        }
      } else {
        stack[depth++] = node.first + 1;
        stack[depth++] = node.first;
      }
    }
    return false;
  }

  class Builder;
  static constexpr std::uint32_t kLeafSize = 6;
  struct Node {
    Bounds bounds;
    std::uint32_t first = 0;  ///< of a leaf: into order_; else the index of the first of two children
    std::uint32_t count = 0;  ///< items of a leaf; 0 for an inner node
  };
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace polestar::detail
