#include "polestar/green/detail/octree.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace polestar::detail {
namespace {

constexpr std::uint32_t kMaxLevel = SortedPoints::kMaxLevel;

// Puts two zeros between the bits of a number of up to 21 bits.
std::uint64_t spreadBits(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffff;
  v = (v | v << 16) & 0x1f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f;
  v = (v | v << 4) & 0x10c30c30c30c30c3;
  v = (v | v << 2) & 0x1249249249249249;
  return v;
}

std::array<std::uint32_t, 3> cellOf(const Cube& cube, const Vec3& point) {
  constexpr double kCells = 1 << kMaxLevel;
  std::array<std::uint32_t, 3> cell;
  for (int k = 0; k < 3; ++k) {
    const double t = (point[k] - cube.low[k]) / cube.side * kCells;
    cell[k] = static_cast<std::uint32_t>(std::clamp(t, 0.0, kCells - 1));
  }
  return cell;
}

std::uint64_t keyOf(const std::array<std::uint32_t, 3>& cell) {
  return spreadBits(cell[0]) | spreadBits(cell[1]) << 1 | spreadBits(cell[2]) << 2;
}

// Whether a box and another of the same size or smaller touch or overlap.
bool touch(const OctreeBox& larger, const OctreeBox& smaller) {
  const std::uint32_t up = smaller.level - larger.level;
  for (int k = 0; k < 3; ++k) {
    const std::int64_t low = static_cast<std::int64_t>(larger.cell[k]) << up;
    const std::int64_t high = low + (std::int64_t{1} << up), c = smaller.cell[k];
    if (c < low - 1 || c > high) return false;
  }
  return true;
}

constexpr std::uint32_t kOffsets = 343;
std::uint32_t offsetIndex(const OctreeBox& source, const OctreeBox& target) {
  std::uint32_t index = 0;
  for (int k = 0; k < 3; ++k) {
    const int d = static_cast<int>(target.cell[k]) - static_cast<int>(source.cell[k]);
    index = index * 7 + static_cast<std::uint32_t>(d + 3);
  }
  return index;
}

}  // namespace

Cube enclosingCube(std::span<const Vec3> points) {
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // Off center by an irrational share: symmetric meshes have many points in their planes of symmetry, where
  // rounding would decide on which side of a box they fall.
  const double side = 1.013 * std::max((high - low).maxCoeff(), 1e-300);
  const Vec3 center = 0.5 * (low + high);
  return {center - side * Vec3(0.4985, 0.4982, 0.4979), side};
}

ExpansionFrame frameOf(const Cube& cube, const OctreeBox& box) {
  const double side = std::ldexp(cube.side, -static_cast<int>(box.level));
  return {cube.low + side * Vec3(box.cell[0] + 0.5, box.cell[1] + 0.5, box.cell[2] + 0.5), side};
}

SortedPoints::SortedPoints(std::span<const Vec3> points, const Cube& cube)
    : keys_(points.size()), order_(points.size()), x_(points.size()), y_(points.size()), z_(points.size()) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    sorted[i] = {keyOf(cellOf(cube, points[i])), static_cast<std::uint32_t>(i)};
  tbb::parallel_sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0; i < points.size(); ++i) {
    keys_[i] = sorted[i].first;
    order_[i] = sorted[i].second;
    const Vec3& p = points[order_[i]];
    x_[i] = p[0];
    y_[i] = p[1];
    z_[i] = p[2];
  }
}

std::uint32_t SortedPoints::levelApart(std::size_t i) const {
  if (i == 0) return 0;
  const std::uint64_t different = keys_[i] ^ keys_[i - 1];
  return kMaxLevel + 1 - static_cast<std::uint32_t>((std::bit_width(different) + 2) / 3);
}

void SortedPoints::split(const OctreeBox& box, std::vector<OctreeBox>& children) const {
  const std::uint32_t level = box.level + 1, drop = 3 * (kMaxLevel - level);
  std::uint32_t begin = box.begin;
  for (std::uint64_t octant = 0; octant < 8; ++octant) {
    const auto past = std::partition_point(keys_.begin() + begin, keys_.begin() + box.end,
                                           [&](std::uint64_t key) { return (key >> drop & 7) <= octant; });
    const auto end = static_cast<std::uint32_t>(past - keys_.begin());
    if (end == begin) continue;
    OctreeBox child;
    for (int k = 0; k < 3; ++k) child.cell[k] = 2 * box.cell[k] + (octant >> k & 1);
    child.level = level;
    child.begin = begin;
    child.end = end;
    children.push_back(child);
    begin = end;
  }
}

SourceTree::SourceTree(std::span<const Vec3> points, const Cube& cube, std::uint32_t leafSize)
    : cube_(cube), points_(points, cube) {
  OctreeBox root;
  root.end = static_cast<std::uint32_t>(points.size());
  boxes_.push_back(root);
  levelStart_ = {0, 1};
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    if (i == levelStart_.back()) levelStart_.push_back(static_cast<std::uint32_t>(boxes_.size()));
    if (boxes_[i].count() <= leafSize || boxes_[i].level >= kMaxLevel) continue;
    const OctreeBox box = boxes_[i];
    const std::size_t first = boxes_.size();
    points_.split(box, boxes_);
    boxes_[i].firstChild = static_cast<std::uint32_t>(first);
    boxes_[i].childCount = static_cast<std::uint32_t>(boxes_.size() - first);
  }
  if (levelStart_.back() != boxes_.size()) levelStart_.push_back(static_cast<std::uint32_t>(boxes_.size()));
}

TargetTree::TargetTree(const SourceTree& sources, std::span<const Vec3> points, double work)
    : points_(points, sources.cube()) {
  OctreeBox root;
  root.end = static_cast<std::uint32_t>(points.size());
  boxes_.push_back(root);
  build(sources, [&](const OctreeBox& box, std::uint64_t nearCharges, std::vector<OctreeBox>& children) {
    if (static_cast<double>(box.count()) * static_cast<double>(nearCharges) > work)
      points_.split(box, children);
  });
}

TargetTree::TargetTree(const SourceTree& sources, std::uint32_t nearCharges, double finest) {
  boxes_.push_back({});
  const double levels = std::clamp(-std::log2(finest), 1.0, static_cast<double>(kMaxLevel));
  build(sources, [&](const OctreeBox& box, std::uint64_t charges, std::vector<OctreeBox>& children) {
    if (charges <= nearCharges || box.level >= levels) return;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      OctreeBox child;
      for (int k = 0; k < 3; ++k) child.cell[k] = 2 * box.cell[k] + (octant >> k & 1);
      child.level = box.level + 1;
      children.push_back(child);
    }
  });
}

template <class Split>
void TargetTree::build(const SourceTree& sources, Split&& split) {
  const std::span<const OctreeBox> source = sources.boxes();
  // Source boxes that a target box still has to deal with, for the level at hand.
  std::vector<std::vector<std::uint32_t>> open{{0}}, openBelow;
  levelStart_ = {0};
  chunkStart_ = {0};
  while (levelStart_.back() < boxes_.size()) {
    const std::uint32_t first = levelStart_.back(), last = static_cast<std::uint32_t>(boxes_.size());
    levelStart_.push_back(last);
    std::vector<std::array<std::uint32_t, 3>> found;  // target, offset, source
    // Boxes of a chunk share batches of translations; few boxes a chunk leave batches half empty.
    const std::uint32_t chunkSize = std::clamp<std::uint32_t>((last - first) / 16, 32, 512);
    openBelow.clear();
    std::vector<OctreeBox> children;
    for (std::uint32_t b = first; b < last; ++b) {
      const OctreeBox box = boxes_[b];
      // Of the parent's open boxes, here already replaced by their children: what is far, what is left.
      const Range singles{static_cast<std::uint32_t>(singles_.size()), 0};
      std::vector<std::uint32_t> left;
      std::uint64_t charges = 0;  // near, of boxes that can be divided on
      for (const std::uint32_t s : open[b - first]) {
        if (touch(source[s], box)) {
          left.push_back(s);
          if (!source[s].isLeaf()) charges += source[s].count();
        } else if (source[s].level == box.level) {
          found.push_back({b, offsetIndex(source[s], box), s});
        } else {
          singles_.push_back(s);
        }
      }
      singlesOf_.push_back({singles.begin, static_cast<std::uint32_t>(singles_.size())});
      children.clear();
      if (charges > 0 && box.level < kMaxLevel) split(box, charges, children);
      const Range near{static_cast<std::uint32_t>(near_.size()), 0};
      if (children.empty()) {
        std::sort(left.begin(), left.end(),
                  [&](std::uint32_t a, std::uint32_t c) { return source[a].begin < source[c].begin; });
        for (const std::uint32_t s : left) {
          if (near_.size() > near.begin && near_.back().end == source[s].begin) {
            near_.back().end = source[s].end;
          } else {
            near_.push_back({source[s].begin, source[s].end});
          }
        }
      } else {
        std::vector<std::uint32_t> refined;
        for (const std::uint32_t s : left) {
          if (source[s].isLeaf()) refined.push_back(s);
          for (std::uint32_t c = 0; c < source[s].childCount; ++c)
            refined.push_back(source[s].firstChild + c);
        }
        boxes_[b].firstChild = static_cast<std::uint32_t>(boxes_.size());
        boxes_[b].childCount = static_cast<std::uint32_t>(children.size());
        boxes_.insert(boxes_.end(), children.begin(), children.end());
        openBelow.insert(openBelow.end(), children.size(), refined);
      }
      nearOf_.push_back({near.begin, static_cast<std::uint32_t>(near_.size())});
      if ((b + 1 - first) % chunkSize == 0 || b + 1 == last) {
        const std::uint32_t chunkFirst = b - (b - first) % chunkSize;
        Chunk chunk{{chunkFirst, b + 1}, {static_cast<std::uint32_t>(groups_.size()), 0}};
        sortPairs(found);
        chunk.groups.end = static_cast<std::uint32_t>(groups_.size());
        chunks_.push_back(chunk);
        found.clear();
      }
    }
    chunkStart_.push_back(static_cast<std::uint32_t>(chunks_.size()));
    std::swap(open, openBelow);
  }
}

// Moves the pairs of a chunk into groups of one offset each.
void TargetTree::sortPairs(std::vector<std::array<std::uint32_t, 3>>& found) {
  std::array<std::uint32_t, kOffsets + 1> start{};
  for (const auto& [target, offset, source] : found) ++start[offset + 1];
  const std::uint32_t base = static_cast<std::uint32_t>(pairs_.size());
  for (std::uint32_t o = 0; o < kOffsets; ++o) {
    if (start[o + 1] > 0) {
      const int index = static_cast<int>(o);
      groups_.push_back({{index / 49 - 3, index / 7 % 7 - 3, index % 7 - 3},
                         {base + start[o], base + start[o] + start[o + 1]}});
    }
    start[o + 1] += start[o];
  }
  pairs_.resize(pairs_.size() + found.size());
  for (const auto& [target, offset, source] : found) pairs_[base + start[offset]++] = {source, target};
}

std::uint32_t TargetTree::locate(const Cube& cube, const Vec3& point) const {
  const std::array<std::uint32_t, 3> cell = cellOf(cube, point);
  std::uint32_t b = 0;
  while (!boxes_[b].isLeaf()) {
    const std::uint32_t drop = kMaxLevel - boxes_[b].level - 1;
    const std::uint32_t octant =
        (cell[0] >> drop & 1) | (cell[1] >> drop & 1) << 1 | (cell[2] >> drop & 1) << 2;
    b = boxes_[b].firstChild + octant;
  }
  return b;
}

}  // namespace polestar::detail
