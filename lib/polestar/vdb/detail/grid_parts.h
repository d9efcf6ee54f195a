#pragma once
// Parts of grids that more than one maker of grids needs.

#include <openvdb/openvdb.h>

#include "polestar/core/types.h"
#include "polestar/vdb/solid_grids.h"
#include "polestar/vdb/value_role.h"

namespace polestar::detail {

/// Grids with a value a voxel; points are none.
using ValueGrids =
    openvdb::NumericGridTypes::Append<openvdb::Vec3GridTypes>::Append<openvdb::BoolGrid, openvdb::MaskGrid>;

/// Bytes.
double machineMemory();

/// @throws Error{Errc::usage} for a grid whose voxels are no cubes.
void requireCubes(const openvdb::GridBase& grid);

/// World = scale * index + translation, to the last bit and at any scale.
openvdb::math::Transform::Ptr makeUniformTransform(double scale, const Vec3& translation);

/// The grid of floats that holds a solid's distances: `surface`, else the first level set; null: none.
openvdb::FloatGrid::ConstPtr findLevelSet(const openvdb::GridCPtrVec& grids);
/// The fog: `density`, else the first fog volume; null: none.
openvdb::FloatGrid::ConstPtr findFog(const openvdb::GridCPtrVec& grids);

/// What `polestar info` says of it.
GridInfo describeGrid(const openvdb::GridBase& grid);

/// The type of a grid's vectors as a role, and the other way round.
ValueRole roleOf(const openvdb::GridBase& grid);
void setRole(openvdb::GridBase& grid, ValueRole role);

}  // namespace polestar::detail
