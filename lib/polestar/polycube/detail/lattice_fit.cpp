#include "polestar/polycube/detail/lattice_fit.h"

#include <algorithm>
#include <queue>
#include <utility>

namespace polestar::detail {
namespace {

/// How far a solid reaches along the lattice's axes, inner units.
struct Extent {
  Vec3 min = Vec3::Zero(), max = Vec3::Zero();
};

Extent extentOf(const ColumnRule& rule, std::span<const double> lengths) {
  Extent extent;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const Vec3 end = lengths[i] * rule.direction(i);
    extent.min = extent.min.cwiseMin(end);
    extent.max = extent.max.cwiseMax(end);
  }
  return extent;
}

/// The cells that the solid meets; where these are more than `cells` a side, without those at the end that it
/// fills less.
CellBox boxAround(const Extent& extent, double cellSide, int cells) {
  CellBox box;
  for (int k = 0; k < 3; ++k) {
    // Cells with |index| >= cells cannot belong to a box of `cells` cells around cell 0.
    const double low = std::max(extent.min[k] / cellSide, -cells + 0.5),
                 high = std::min(extent.max[k] / cellSide, cells - 0.5);
    box.min[k] = std::max(1 - cells, static_cast<int>(std::floor(low + 0.5)));
    box.max[k] = std::min(cells - 1, static_cast<int>(std::floor(high + 0.5)));
    while (box.side(k) > cells) {
      const bool lowFillsLess = box.min[k] + 0.5 - low < high - (box.max[k] - 0.5);
      if (lowFillsLess)
        ++box.min[k];
      else
        --box.max[k];
    }
  }
  return box;
}

/// A lattice with fewer planes: runs of layers taken for one. Layers of one slab stay together.
class Slabs {
 public:
  explicit Slabs(const CellBox& box) : box_(box) {
    for (int k = 0; k < 3; ++k) planes_[k].assign(static_cast<std::size_t>(box.side(k)) + 1, 1);
  }

  /// Planes between layers, each an axis and how many layers lie below.
  using Plane = std::pair<int, int>;
  std::vector<Plane> inner() const {
    std::vector<Plane> planes;
    for (int k = 0; k < 3; ++k) {
      for (int i = 1; i < box_.side(k); ++i) {
        if (planes_[k][i]) planes.emplace_back(k, i);
      }
    }
    return planes;
  }
  Slabs without(const Plane& plane) const {
    Slabs fewer = *this;
    fewer.planes_[plane.first][plane.second] = 0;
    return fewer;
  }

  /// Volumes of the blocks between the planes; the slabs with the center have index 0.
  CellVolumes merged(const CellVolumes& fine) const {
    CellVolumes blocks{blockBox(), {}, {}, fine.solid};
    blocks.inside.resize(blocks.box.size());
    blocks.all.resize(blocks.box.size());
    forEachCell([&](std::size_t cell, std::size_t block) {
      blocks.inside[block] += fine.inside[cell];
      blocks.all[block] += fine.all[cell];
    });
    return blocks;
  }

  /// The cells of chosen blocks.
  std::vector<char> cellsOf(std::span<const char> blocks) const {
    std::vector<char> cells(box_.size());
    forEachCell([&](std::size_t cell, std::size_t block) { cells[cell] = blocks[block]; });
    return cells;
  }

 private:
  /// Index of the slab of each layer along an axis.
  std::vector<int> slabs(int axis) const {
    std::vector<int> slab(static_cast<std::size_t>(box_.side(axis)), 0);
    const int center = -box_.min[axis];
    for (int i = center + 1; i < box_.side(axis); ++i) slab[i] = slab[i - 1] + planes_[axis][i];
    for (int i = center - 1; i >= 0; --i) slab[i] = slab[i + 1] - planes_[axis][i + 1];
    return slab;
  }
  CellBox blockBox() const {
    CellBox box;
    for (int k = 0; k < 3; ++k) {
      const std::vector<int> slab = slabs(k);
      box.min[k] = slab.front();
      box.max[k] = slab.back();
    }
    return box;
  }
  template <class Visit>
  void forEachCell(Visit&& visit) const {
    const CellBox blocks = blockBox();
    const std::array<std::vector<int>, 3> slab{slabs(0), slabs(1), slabs(2)};
    std::size_t cell = 0;
    for (const int i : slab[0]) {
      for (const int j : slab[1]) {
        for (const int k : slab[2]) visit(cell++, blocks.index({i, j, k}));
      }
    }
  }

  CellBox box_;
  std::array<std::vector<char>, 3> planes_;
};

}  // namespace

Polycube polycubeOf(const LatticeFit& fit) {
  std::vector<Cell> cells;
  Cell cell;
  for (cell[0] = fit.box.min[0]; cell[0] <= fit.box.max[0]; ++cell[0]) {
    for (cell[1] = fit.box.min[1]; cell[1] <= fit.box.max[1]; ++cell[1]) {
      for (cell[2] = fit.box.min[2]; cell[2] <= fit.box.max[2]; ++cell[2]) {
        if (fit.filled[fit.box.index(cell)]) cells.push_back(cell);
      }
    }
  }
  return verifyPolycube(std::move(cells));
}

LatticeFitter::LatticeFitter(int cells, int columnsPerSide)
    : cells_(cells), rule_(columnsPerSide), measure_(rule_, cells) {}

LatticeFit LatticeFitter::firstFit(std::span<const double> lengths) const {
  const Extent extent = extentOf(rule_, lengths);
  const double longest = (extent.max - extent.min).maxCoeff();
  LatticeFit best;
  // Cells that divide the solid's longest side by a little less or more than is allowed: the layers at its
  // ends may be left out, or fill only a part of theirs.
  for (const double more : {-1.0, -0.5, 0.0, 0.5}) {
    LatticeFit next = bestSet(lengths, longest / std::max(cells_ + more, 0.5));
    if (next.overlap > best.overlap) best = std::move(next);
  }
  return best;
}

LatticeFit LatticeFitter::bestSet(std::span<const double> lengths, double cellSide) const {
  const CellBox box = boxAround(extentOf(rule_, lengths), cellSide, cells_);
  BestOverlap cells = bestOverlap(measure_.volumes(rule_, lengths, cellSide, box));
  return {box, std::move(cells.chosen), cellSide, cells.overlap};
}

LatticeFit LatticeFitter::fit(std::span<const double> lengths) const {
  constexpr double kGain = 1e-6;  // below which another round is not worth it
  LatticeFit best = firstFit(lengths);
  for (;;) {
    const BestScale size = bestScale(lengths, columnLengths(rule_, best.box, best.filled));
    best.cellSide = size.scale;
    best.overlap = size.overlap;
    LatticeFit next = bestSet(lengths, size.scale);
    if (!(next.overlap > best.overlap + kGain)) return best;
    best = std::move(next);
  }
}

LatticeFit LatticeFitter::withFewPlanes(std::span<const double> lengths, const LatticeFit& fit,
                                        double overlap) const {
  const CellVolumes fine = measure_.volumes(rule_, lengths, fit.cellSide, fit.box);
  const auto overlapOf = [&](const Slabs& slabs) { return bestOverlap(slabs.merged(fine)).overlap; };

  // Without one plane more there are fewer sets to choose from: what a plane's loss left when there were more
  // planes bounds what it leaves now. So only the front of the queue has to be looked at again.
  Slabs slabs(fit.box);
  using Entry = std::pair<double, Slabs::Plane>;
  std::priority_queue<Entry> queue;
  for (const Slabs::Plane& plane : slabs.inner()) queue.emplace(1.0, plane);
  while (!queue.empty() && queue.top().first >= overlap) {
    const Slabs::Plane plane = queue.top().second;
    queue.pop();
    Slabs fewer = slabs.without(plane);
    const double left = overlapOf(fewer);
    if (queue.empty() || left >= queue.top().first) {
      if (left < overlap) break;
      slabs = std::move(fewer);
    } else {
      queue.emplace(left, plane);
    }
  }

  LatticeFit result = fit;
  result.filled = slabs.cellsOf(bestOverlap(slabs.merged(fine)).chosen);
  const BestScale size = bestScale(lengths, columnLengths(rule_, fit.box, result.filled));
  result.cellSide = size.scale;
  result.overlap = size.overlap;
  return result;
}

}  // namespace polestar::detail
