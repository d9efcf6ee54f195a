#include "polestar/vdb/detail/resampled_grid.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <type_traits>
#include <vector>

#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/Prune.h>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/vdb/detail/grid_parts.h"

namespace polestar::detail {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using MaskLeaf = openvdb::MaskTree::LeafNodeType;

constexpr float kLeastWeight = 1e-3f;  // less is rounding at the edge of a neighbour
constexpr double kBytesPerVoxel = 16;

void checkMemory(const openvdb::GridBase& grid, const openvdb::math::Transform& lattice) {
  const openvdb::Vec3d old = grid.voxelSize();
  const double ratio = old.x() * old.y() * old.z() / std::pow(lattice.voxelSize()[0], 3);
  const double bytes = static_cast<double>(grid.activeVoxelCount()) * ratio * kBytesPerVoxel;
  const double limit = 0.75 * machineMemory();
  if (bytes <= limit) return;
  std::ostringstream message;
  message.precision(4);
  message << "the grid " << grid.getName() << " would take about " << bytes / 1e9 << " GB of the "
          << limit / 1e9 << " GB allowed; voxels of " << lattice.voxelSize()[0] * std::cbrt(bytes / limit)
          << " would fit";
  throw Error(Errc::usage, message.str());
}

/// New voxels that meet one of `box`, index space of the old grid.
CoordBBox met(const CoordBBox& box, const openvdb::math::Transform& old,
              const openvdb::math::Transform& lattice) {
  openvdb::Vec3d low(1e300), high(-1e300);
  for (int corner = 0; corner < 8; ++corner) {
    // A voxel more, which trilinear reading reaches.
    const openvdb::Vec3d at((corner & 1 ? box.max() : box.min()).x() + (corner & 1 ? 1 : -1),
                            (corner & 2 ? box.max() : box.min()).y() + (corner & 2 ? 1 : -1),
                            (corner & 4 ? box.max() : box.min()).z() + (corner & 4 ? 1 : -1));
    const openvdb::Vec3d index = lattice.worldToIndex(old.indexToWorld(at));
    low = openvdb::math::minComponent(low, index);
    high = openvdb::math::maxComponent(high, index);
  }
  return {Coord::floor(low - 0.5), Coord::ceil(high + 0.5)};
}

template <class Tree>
openvdb::MaskTree candidates(const openvdb::Grid<Tree>& grid, const openvdb::math::Transform& lattice) {
  openvdb::MaskTree mask;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    CoordBBox box;
    leaf->evalActiveBoundingBox(box);
    if (!box.empty()) mask.fill(met(box, grid.transform(), lattice), true);
  }
  auto tile = grid.tree().cbeginValueOn();
  tile.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) mask.fill(met(tile.getBoundingBox(), grid.transform(), lattice), true);
  mask.voxelizeActiveTiles();
  return mask;
}

float fromVector(const Vec3f& v, float) { return v.x(); }
openvdb::Vec3s fromVector(const Vec3f& v, const openvdb::Vec3s&) { return openvdb::Vec3s(v.data()); }

/// The new voxels that may meet old ones, filled leaf by leaf: fillLeaf(voxels, leaf) sets those that do.
template <class Tree, class FillLeaf>
openvdb::GridBase::Ptr filled(const openvdb::Grid<Tree>& grid, const openvdb::math::Transform& lattice,
                              Context& context, FillLeaf&& fillLeaf) {
  using Leaf = typename Tree::LeafNodeType;
  const openvdb::MaskTree mask = candidates(grid, lattice);
  std::vector<const MaskLeaf*> places;
  mask.getNodes(places);
  std::vector<std::unique_ptr<Leaf>> leaves(places.size());
  const std::size_t portion = std::max<std::size_t>(places.size() / 100, 16);
  for (std::size_t done = 0; done < places.size(); done += portion) {
    context.progress("resampling " + grid.getName(),
                     static_cast<double>(done) / static_cast<double>(places.size()));
    parallelChunks(std::min(places.size() - done, portion), 1, context, [&](std::size_t l, std::size_t) {
      auto leaf = std::make_unique<Leaf>(places[done + l]->origin(), grid.background());
      fillLeaf(*places[done + l], *leaf);
      if (!leaf->isEmpty()) leaves[done + l] = std::move(leaf);
    });
  }
  const auto tree = std::make_shared<Tree>(grid.background());
  for (std::unique_ptr<Leaf>& leaf : leaves) {
    if (leaf) tree->addLeaf(leaf.release());
  }
  openvdb::tools::prune(*tree);
  return openvdb::Grid<Tree>::create(tree);
}

template <class Tree>
openvdb::GridBase::Ptr averaged(const openvdb::Grid<Tree>& grid, const SampledGrid& values,
                                const openvdb::math::Transform& lattice, Context& context) {
  const bool fog = grid.getGridClass() == openvdb::GRID_FOG_VOLUME || grid.getName() == "density";
  const Mat3 footprint = lattice.voxelSize()[0] * Mat3::Identity();
  return filled(grid, lattice, context, [&](const MaskLeaf& voxels, auto& leaf) {
    std::vector<Vec3> points;
    for (auto on = voxels.cbeginValueOn(); on; ++on) {
      const openvdb::Vec3d at = lattice.indexToWorld(on.getCoord());
      points.emplace_back(at.x(), at.y(), at.z());
    }
    const std::vector<Mat3> footprints(points.size(), footprint);
    std::vector<Vec3f> found(points.size());
    std::vector<float> weights(points.size());
    values.sample(points, footprints, found, weights);
    std::size_t i = 0;
    for (auto on = voxels.cbeginValueOn(); on; ++on, ++i) {
      if (weights[i] < kLeastWeight) continue;
      leaf.setValueOn(on.pos(), fromVector(fog ? Vec3f(found[i] * weights[i]) : found[i], grid.background()));
    }
  });
}

template <class Tree>
openvdb::GridBase::Ptr read(const openvdb::Grid<Tree>& grid, const openvdb::math::Transform& lattice,
                            Context& context) {
  using Value = typename Tree::ValueType;
  constexpr bool real = std::is_same_v<Value, double> || std::is_same_v<Value, openvdb::Vec3d>;
  return filled(grid, lattice, context, [&](const MaskLeaf& voxels, auto& leaf) {
    // Not registered with the tree: nothing changes that while we read.
    openvdb::tree::ValueAccessor<const Tree, false> from(grid.tree());
    for (auto on = voxels.cbeginValueOn(); on; ++on) {
      const openvdb::Vec3d index = grid.transform().worldToIndex(lattice.indexToWorld(on.getCoord()));
      const Coord nearest = Coord::round(index);
      if (!from.isValueOn(nearest)) continue;
      if constexpr (real)
        leaf.setValueOn(on.pos(), openvdb::tools::BoxSampler::sample(from, index));
      else
        leaf.setValueOn(on.pos(), from.getValue(nearest));
    }
  });
}

}  // namespace

openvdb::math::Transform::Ptr latticeBeside(const openvdb::GridBase& reference, double voxelSize) {
  const openvdb::Vec3d first = reference.transform().indexToWorld(Coord(0, 0, 0)),
                       old = reference.voxelSize();
  Vec3 shift;
  for (int k = 0; k < 3; ++k) shift[k] = first[k] + 0.5 * (voxelSize - old[k]);
  return makeUniformTransform(voxelSize, shift);
}

openvdb::GridBase::Ptr resampledGrid(const openvdb::GridBase& grid, const SampledGrid* values,
                                     const openvdb::math::Transform& lattice, Context& context) {
  checkMemory(grid, lattice);
  openvdb::GridBase::Ptr result;
  grid.apply<ValueGrids>([&](const auto& typed) {
    using Value = typename std::decay_t<decltype(typed)>::ValueType;
    if constexpr (std::is_same_v<Value, float> || std::is_same_v<Value, openvdb::Vec3s>)
      result = averaged(typed, *values, lattice, context);
    else
      result = read(typed, lattice, context);
  });
  return result;
}

}  // namespace polestar::detail
