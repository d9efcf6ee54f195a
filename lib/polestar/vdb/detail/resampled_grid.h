#pragma once
// A grid on other voxels.

#include <openvdb/openvdb.h>

#include "polestar/core/context.h"
#include "polestar/vdb/sampled_grids.h"

namespace polestar::detail {

/// Voxels of that size; the lower corner of voxel (0, 0, 0) is that of the reference's.
openvdb::math::Transform::Ptr latticeBeside(const openvdb::GridBase& reference, double voxelSize);

/// A grid of values, read at the centers of the new voxels. Floats and vec3s are averaged over what each new
/// voxel covers, by `values`, which looks into that grid: of a fog the space around counts as 0, so that its
/// mass stays; of others only voxels with a value count, and new ones that meet none are inactive. Doubles
/// are read trilinearly, whole numbers and booleans from the nearest voxel. Null for types that are no grids
/// of values.
/// @throws Error{Errc::usage} for more than memory holds; Error{Errc::cancelled}
openvdb::GridBase::Ptr resampledGrid(const openvdb::GridBase& grid, const SampledGrid* values,
                                     const openvdb::math::Transform& lattice, Context& context);

}  // namespace polestar::detail
