#include "polestar/sphere/detail/nested_dissection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace polestar::detail {
namespace {

/// Sets this small are taken as they come: dense algebra is fast on them.
constexpr std::ptrdiff_t kLeaf = 24;

class Dissection {
 public:
  Dissection(const Laplacian& graph, std::span<const Vec3> positions)
      : graph_(graph),
        positions_(positions),
        order_(graph.size()),
        height_(graph.size()),
        part_(graph.size(), 0) {
    std::iota(order_.begin(), order_.end(), 0);
  }

  Elimination run() && {
    dissect(order_.begin(), order_.end());
    return {std::move(order_), std::move(parts_)};
  }

 private:
  using Iterator = std::vector<std::int32_t>::iterator;

  // Returns the number of the part.
  std::int32_t dissect(Iterator begin, Iterator end) {
    if (end - begin <= kLeaf) return add({place(begin), place(begin), place(end)});
    const Iterator middle = begin + (end - begin) / 2;
    const std::array<Vec3, 3> frame = axes(begin, end);
    std::ptrdiff_t fewest = end - begin;
    int best = 0;
    for (int axis = 0; axis < 3; ++axis) {
      halve(frame[axis], begin, middle, end);
      const std::ptrdiff_t cut = std::count_if(begin, middle, [&](std::int32_t v) { return seesUpper(v); });
      if (cut < fewest) fewest = cut, best = axis;
    }
    if (best != 2) halve(frame[best], begin, middle, end);
    // The vertices of the first half that see the second become the separator and go last.
    const Iterator separator =
        std::stable_partition(begin, middle, [&](std::int32_t v) { return !seesUpper(v); });
    const Iterator last = std::rotate(separator, middle, end);
    const std::int32_t lower = dissect(begin, separator), upper = dissect(separator, last);
    return add({place(begin), place(last), place(end), lower, upper});
  }

  std::int32_t place(Iterator position) const { return static_cast<std::int32_t>(position - order_.begin()); }

  std::int32_t add(const Elimination::Part& part) {
    parts_.push_back(part);
    return static_cast<std::int32_t>(parts_.size()) - 1;
  }

  // Towards the vertex farthest from the mean, the one farthest from that axis, and across both: the set's
  // own axes, which turn with it.
  std::array<Vec3, 3> axes(Iterator begin, Iterator end) const {
    Vec3 mean = Vec3::Zero();
    std::for_each(begin, end, [&](std::int32_t v) { mean += positions_[v]; });
    mean /= static_cast<double>(end - begin);
    Vec3 first = Vec3::Zero(), second = Vec3::Zero();
    std::for_each(begin, end, [&](std::int32_t v) {
      const Vec3 away = positions_[v] - mean;
      if (away.squaredNorm() > first.squaredNorm()) first = away;
    });
    first.normalize();
    std::for_each(begin, end, [&](std::int32_t v) {
      const Vec3 away = positions_[v] - mean, across = away - first * first.dot(away);
      if (across.squaredNorm() > second.squaredNorm()) second = across;
    });
    return {first, second, first.cross(second)};
  }

  // Lower half in front of `middle`, both marked.
  void halve(const Vec3& along, Iterator begin, Iterator middle, Iterator end) {
    std::for_each(begin, end, [&](std::int32_t v) { height_[v] = along.dot(positions_[v]); });
    std::nth_element(begin, middle, end, [&](std::int32_t a, std::int32_t b) {
      return height_[a] != height_[b] ? height_[a] < height_[b] : a < b;
    });
    lastPart_ += 2;
    std::for_each(begin, middle, [&](std::int32_t v) { part_[v] = lastPart_ - 1; });
    std::for_each(middle, end, [&](std::int32_t v) { part_[v] = lastPart_; });
  }

  bool seesUpper(std::int32_t v) const {
    for (std::size_t e = graph_.rowStart[v]; e < graph_.rowStart[v + 1]; ++e) {
      if (part_[graph_.column[e]] == lastPart_) return true;
    }
    return false;
  }

  const Laplacian& graph_;
  std::span<const Vec3> positions_;
  std::vector<std::int32_t> order_;
  std::vector<Elimination::Part> parts_;
  std::vector<double> height_;
  std::vector<std::int32_t> part_;  ///< vertices of one part carry its number until they are split again
  std::int32_t lastPart_ = 0;
};

}  // namespace

Elimination nestedDissection(const Laplacian& graph, std::span<const Vec3> positions) {
  return Dissection(graph, positions).run();
}

}  // namespace polestar::detail
