#pragma once
// From a closed mesh to OpenVDB's narrow band. Apart from solid_grids.cpp because OpenVDB's mesh tool takes
// the compiler longer than everything else in this folder together.

#include <openvdb/openvdb.h>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Signed distance, negative inside, to a closed embedded surface given in index space, at integer points.
/// Active where it is below `halfWidth` voxels; elsewhere +-halfWidth, with whole tiles inside and outside.
/// Values are multiplied by `voxelSize`, which has no other effect: the geometry is voxelized in index units,
/// whatever the size of a voxel.
/// @throws Error{Errc::cancelled}.
openvdb::FloatTree::Ptr meshToLevelSet(const TriMesh& surface, int halfWidth, double voxelSize,
                                       const Context& context);

}  // namespace polestar::detail
