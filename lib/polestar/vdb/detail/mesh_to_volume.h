#pragma once
// From a mesh to a level set by OpenVDB's own tool: faster than mesh_to_level_set.h, and for surfaces that
// run through each other.

#include <openvdb/openvdb.h>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// As meshToLevelSet(), by OpenVDB's meshToVolume. What overlaps becomes one, cavities are filled.
/// @throws Error{Errc::cancelled}
openvdb::FloatTree::Ptr meshToVolume(const TriMesh& surface, int halfWidth, double voxelSize,
                                     const Context& context);

}  // namespace polestar::detail
