#include "polestar/vdb/detail/turned_grid.h"

#include <vector>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/vdb/detail/grid_parts.h"

namespace polestar::detail {
namespace {

using openvdb::Coord;

Vec3 toEigen(const openvdb::Vec3d& v) { return {v.x(), v.y(), v.z()}; }

/// World' = turned world, for renumbered voxels.
openvdb::math::Transform::Ptr turnedTransform(const openvdb::math::Transform& old, const AxisTurn& turn) {
  using namespace openvdb::math;
  // Exactly, and at any scale, where there is one scale.
  if (old.baseMap()->isType<UniformScaleMap>() || old.baseMap()->isType<UniformScaleTranslateMap>()) {
    const double h = old.voxelSize()[0];
    Vec3 shift = turn.vector(toEigen(old.indexToWorld(Coord(0, 0, 0))));
    for (int k = 0; k < 3; ++k) {
      if (turn.negated(k)) shift[k] += h;
    }
    return makeUniformTransform(h, shift);
  }
  const Mat4d rows = old.baseMap()->getAffineMap()->getMat4();  // world = index * rows
  Mat4d made = Mat4d::identity();
  for (int k = 0; k < 3; ++k) {
    const double sign = turn.negated(k) ? -1 : 1;
    double shift = sign * rows(3, turn.source(k));
    for (int j = 0; j < 3; ++j) {
      const double entry = sign * rows(turn.source(j), turn.source(k));
      made(j, k) = turn.negated(j) ? -entry : entry;
      if (turn.negated(j)) shift -= entry;
    }
    made(3, k) = shift;
  }
  return std::make_shared<Transform>(simplify(std::make_shared<AffineMap>(made)));
}

template <class Value>
Value turnedValue(const Value& value, const AxisTurn&) {
  return value;
}
template <class Number>
openvdb::math::Vec3<Number> turnedValue(const openvdb::math::Vec3<Number>& v, const AxisTurn& turn) {
  openvdb::math::Vec3<Number> result;
  for (int k = 0; k < 3; ++k) result[k] = turn.negated(k) ? -v[turn.source(k)] : v[turn.source(k)];
  return result;
}

template <class Leaf>
std::unique_ptr<Leaf> turnedLeaf(const Leaf& leaf, const AxisTurn& turn, bool values,
                                 const typename Leaf::ValueType& background) {
  constexpr int last = static_cast<int>(Leaf::DIM) - 1;
  const Coord a = turn.index(leaf.origin()), b = turn.index(leaf.origin().offsetBy(last));
  auto made = std::make_unique<Leaf>(Coord::minComponent(a, b), background);
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    const auto value = leaf.getValue(i);
    const openvdb::Index to = Leaf::coordToOffset(turn.index(leaf.offsetToGlobalCoord(i)));
    made->setValueOnly(to, values ? turnedValue(value, turn) : value);
    made->setActiveState(to, leaf.isValueOn(i));
  }
  return made;
}

template <class Grid>
openvdb::GridBase::Ptr turnedTyped(const Grid& grid, const AxisTurn& turn) {
  using Tree = typename Grid::TreeType;
  using Leaf = typename Tree::LeafNodeType;
  const bool values = roleOf(grid) != ValueRole::invariant;
  const auto background = values ? turnedValue(grid.background(), turn) : grid.background();
  const auto tree = std::make_shared<Tree>(background);

  std::vector<const Leaf*> leaves;
  grid.tree().getNodes(leaves);
  std::vector<std::unique_ptr<Leaf>> made(leaves.size());
  parallelChunks(leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l) made[l] = turnedLeaf(*leaves[l], turn, values, background);
  });
  for (std::unique_ptr<Leaf>& leaf : made) tree->addLeaf(leaf.release());

  auto tile = grid.tree().cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (!tile.isValueOn() && *tile == grid.background()) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    const Coord low = Coord::minComponent(turn.index(box.min()), turn.index(box.max()));
    tree->addTile(static_cast<openvdb::Index>(Tree::DEPTH - 1 - tile.getDepth()), low,
                  values ? turnedValue(*tile, turn) : *tile, tile.isValueOn());
  }
  auto result = Grid::create(tree);
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry)
    result->insertMeta(entry->first, *entry->second);
  result->setTransform(turnedTransform(grid.transform(), turn));
  return result;
}

/// What the metadata says of places turns along; the map does not.
void turnMetadata(openvdb::GridBase& grid, const AxisTurn& turn) {
  grid.removeMeta("polestar:map_hash");
  if (const auto center = grid.getMetadata<openvdb::Vec3DMetadata>("polestar:center")) {
    const Vec3 at = turn.vector(toEigen(center->value()));
    grid.insertMeta("polestar:center", openvdb::Vec3DMetadata({at.x(), at.y(), at.z()}));
  }
}

}  // namespace

openvdb::GridBase::Ptr turnedGrid(const openvdb::GridBase& grid, const AxisTurn& turn) {
  if (!grid.transform().isLinear()) {
    throw Error(Errc::usage, "the grid " + grid.getName() +
                                 " fills a frustum, which cannot be turned; resample it first with --voxel");
  }
  if (grid.getGridClass() == openvdb::GRID_STAGGERED) {
    throw Error(Errc::usage,
                "the grid " + grid.getName() +
                    " holds staggered vectors, which cannot be turned; leave it out with --drop");
  }
  openvdb::GridBase::Ptr result;
  grid.apply<ValueGrids>([&](const auto& typed) { result = turnedTyped(typed, turn); });
  if (result) turnMetadata(*result, turn);
  return result;
}

}  // namespace polestar::detail
