#pragma once
// Parts of grids that more than one maker of grids needs.

#include <openvdb/openvdb.h>

#include "polestar/core/types.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar::detail {

/// World = scale * index + translation, to the last bit and at any scale.
openvdb::math::Transform::Ptr makeUniformTransform(double scale, const Vec3& translation);

openvdb::Metadata::Ptr toOpenVdb(const Metadata& value);

}  // namespace polestar::detail
