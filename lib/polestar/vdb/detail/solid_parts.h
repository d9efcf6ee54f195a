#pragma once
// What makers of the grids `surface` and `density` share.

#include <openvdb/openvdb.h>

#include <string>

#include "polestar/vdb/solid_grids.h"

namespace polestar::detail {

/// @throws Error{Errc::usage} when the grids of a solid would not fit in memory (the message says which size
/// does), or it is smaller than 4 voxels.
void checkSolidSize(const TriMesh& surface, const GridOptions& options);

/// Where the center of voxel (0, 0, 0) lies: its lower corner is that of the surface's box.
inline Vec3 solidOrigin(const TriMesh& surface, double voxelSize) {
  return boundingBox(surface).min + Vec3::Constant(0.5 * voxelSize);
}

/// The fog of a level set: 1 from one voxel inside the surface, 0 from one voxel outside, linear in the
/// distance between.
openvdb::FloatTree::Ptr fogOf(const openvdb::FloatTree& levelSet, double voxelSize);

/// Says of a grid what it is and that polestar made it.
void label(openvdb::GridBase& grid, const std::string& name, const openvdb::math::Transform::Ptr& transform,
           openvdb::GridClass kind);

template <class Tree>
typename openvdb::Grid<Tree>::Ptr makeGrid(const std::string& name, typename Tree::Ptr tree,
                                           const openvdb::math::Transform::Ptr& transform,
                                           openvdb::GridClass kind) {
  auto grid = openvdb::Grid<Tree>::create(tree);
  label(*grid, name, transform, kind);
  return grid;
}

}  // namespace polestar::detail
