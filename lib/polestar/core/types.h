#pragma once
// The few types that every stage shares.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

namespace polestar {

using Vec3 = Eigen::Vector3d;
using Vec3f = Eigen::Vector3f;
using Mat3 = Eigen::Matrix3d;

/// Three vertex indices, counter-clockwise seen from outside.
using Triangle = std::array<std::int32_t, 3>;

}  // namespace polestar
