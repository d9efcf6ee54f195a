#include "polestar/green/detail/near_index.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

// A leaf this small lists few triangles that are not near its points.
constexpr double kLeafSide = 0.6;  // of the mean near radius
constexpr std::size_t kFewCandidates = 48;
constexpr std::uint32_t kDeepest = 20;

bool reaches(const NearField::Sphere& sphere, const Vec3& low, double side) {
  const Vec3 nearest = sphere.center.cwiseMax(low).cwiseMin(low + Vec3::Constant(side));
  return (nearest - sphere.center).squaredNorm() < sphere.radius * sphere.radius;
}

}  // namespace

NearIndex::NearIndex(const NearField& field, const Cube& cube, const Context& context) : cube_(cube) {
  boxes_.emplace_back();
  std::vector<std::vector<std::uint32_t>> lists(1), below;
  for (std::uint32_t t = 0; t < field.triangleCount(); ++t) lists[0].push_back(t);
  std::uint32_t first = 0;
  for (std::uint32_t level = 0; first < boxes_.size(); ++level) {
    const auto last = static_cast<std::uint32_t>(boxes_.size());
    const double side = std::ldexp(cube.side, -static_cast<int>(level));
    std::vector<std::uint32_t> split;
    for (std::uint32_t b = first; b < last; ++b) {
      const std::vector<std::uint32_t>& list = lists[b - first];
      double radius = 0;
      for (const std::uint32_t t : list) radius += field.nearSphere(t).radius;
      if (list.size() > kFewCandidates && level < kDeepest &&
          side > kLeafSide * radius / static_cast<double>(list.size())) {
        split.push_back(b);
        continue;
      }
      boxes_[b].begin = static_cast<std::uint32_t>(candidates_.size());
      candidates_.insert(candidates_.end(), list.begin(), list.end());
      boxes_[b].end = static_cast<std::uint32_t>(candidates_.size());
    }
    for (const std::uint32_t b : split) {
      boxes_[b].firstChild = static_cast<std::uint32_t>(boxes_.size());
      for (std::uint32_t octant = 0; octant < 8; ++octant) {
        Box child;
        for (int k = 0; k < 3; ++k) child.cell[k] = 2 * boxes_[b].cell[k] + (octant >> k & 1);
        boxes_.push_back(child);
      }
    }
    below.assign(8 * split.size(), {});
    parallelChunks(below.size(), 8, context, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) {
        const Box& child = boxes_[last + c];
        const Vec3 low = cube.low + side / 2 * Vec3(child.cell[0], child.cell[1], child.cell[2]);
        for (const std::uint32_t t : lists[split[c / 8] - first]) {
          if (reaches(field.nearSphere(t), low, side / 2)) below[c].push_back(t);
        }
      }
    });
    std::swap(lists, below);
    first = last;
  }
}

std::uint32_t NearIndex::locate(const Vec3& point) const {
  Vec3 t = ((point - cube_.low) / cube_.side).cwiseMax(0.0).cwiseMin(1 - 1e-12);
  std::uint32_t b = 0;
  while (boxes_[b].firstChild != 0) {
    std::uint32_t octant = 0;
    for (int k = 0; k < 3; ++k) {
      t[k] *= 2;
      if (t[k] >= 1) {
        octant |= 1u << k;
        t[k] -= 1;
      }
    }
    b = boxes_[b].firstChild + octant;
  }
  return b;
}

}  // namespace polestar::detail
