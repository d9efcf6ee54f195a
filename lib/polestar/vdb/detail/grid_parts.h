#pragma once
// Parts of grids that more than one maker of grids needs.

#include <openvdb/openvdb.h>

#include "polestar/core/types.h"
#include "polestar/vdb/value_role.h"

namespace polestar::detail {

/// World = scale * index + translation, to the last bit and at any scale.
openvdb::math::Transform::Ptr makeUniformTransform(double scale, const Vec3& translation);

/// The type of a grid's vectors as a role, and the other way round.
ValueRole roleOf(const openvdb::GridBase& grid);
void setRole(openvdb::GridBase& grid, ValueRole role);

}  // namespace polestar::detail
