#include "polestar/morph/detail/cell_raster.h"

#include "polestar/core/detail/aabb_tree.h"
#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kChunk = 1 << 15;

int leafOf(double index) { return static_cast<int>(std::floor(index / CellRaster::kLeafSize)); }

struct Entry {
  std::uint32_t leaf, cell;
};

}  // namespace

CellRaster::CellRaster(const Foliation& ball, std::span<const Vec3> nodes) : ball_(ball), nodes_(nodes) {
  Bounds all;
  // The surface is around all else.
  for (const Vec3& node : nodes.first(ball.vertexCount)) all.include(node);
  for (int k = 0; k < 3; ++k) {
    lowest_[k] = leafOf(all.min[k] - 1);
    leaves_[k] = leafOf(all.max[k] + 1) - lowest_[k] + 1;
  }
  const auto clampedLeaf = [&](double index, int axis) {
    return std::clamp(leafOf(index) - lowest_[axis], 0, leaves_[axis] - 1);
  };
  using Entries = std::vector<Entry>;
  const Entries entries = reduceChunks(
      ball.cellCount(), kChunk, Entries{},
      [&](std::size_t chunkBegin, std::size_t chunkEnd) {
        Entries part;
        for (std::size_t id = chunkBegin; id < chunkEnd; ++id) {
          Bounds box;
          for (const std::uint32_t node : ball.cell(id)) box.include(nodes[node]);
          // No voxel's center lies in most boxes of thin cells.
          bool any = true;
          for (int k = 0; k < 3; ++k) any = any && std::ceil(box.min[k] - kSlack) <= box.max[k] + kSlack;
          if (!any) continue;
          const auto last = [&](int k) { return clampedLeaf(box.max[k] + kSlack, k); };
          for (int x = clampedLeaf(box.min[0] - kSlack, 0); x <= last(0); ++x) {
            for (int y = clampedLeaf(box.min[1] - kSlack, 1); y <= last(1); ++y) {
              for (int z = clampedLeaf(box.min[2] - kSlack, 2); z <= last(2); ++z) {
                part.push_back({static_cast<std::uint32_t>((x * leaves_[1] + y) * leaves_[2] + z),
                                static_cast<std::uint32_t>(id)});
              }
            }
          }
        }
        return part;
      },
      [](Entries sum, const Entries& part) {
        sum.insert(sum.end(), part.begin(), part.end());
        return sum;
      });
  begin_.assign(static_cast<std::size_t>(leaves_[0]) * leaves_[1] * leaves_[2] + 1, 0);
  for (const Entry& entry : entries) ++begin_[entry.leaf + 1];
  for (std::size_t leaf = 1; leaf < begin_.size(); ++leaf) begin_[leaf] += begin_[leaf - 1];
  cells_.resize(entries.size());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (const Entry& entry : entries) cells_[next[entry.leaf]++] = entry.cell;
}

std::span<const std::uint32_t> CellRaster::cellsOf(const std::array<int, 3>& first) const {
  std::array<int, 3> at{};
  for (int k = 0; k < 3; ++k) {
    at[k] = first[k] / kLeafSize - (first[k] % kLeafSize < 0 ? 1 : 0) - lowest_[k];
    if (at[k] < 0 || at[k] >= leaves_[k]) return {};
  }
  const auto leaf = static_cast<std::size_t>((at[0] * leaves_[1] + at[1]) * leaves_[2] + at[2]);
  return std::span(cells_).subspan(begin_[leaf], begin_[leaf + 1] - begin_[leaf]);
}

}  // namespace polestar::detail
