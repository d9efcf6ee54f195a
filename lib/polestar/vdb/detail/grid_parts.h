#pragma once
// Parts of grids that more than one maker of grids needs.

#include <openvdb/openvdb.h>

#include "polestar/core/types.h"

namespace polestar::detail {

/// World = scale * index + translation, to the last bit and at any scale.
openvdb::math::Transform::Ptr makeUniformTransform(double scale, const Vec3& translation);

}  // namespace polestar::detail
