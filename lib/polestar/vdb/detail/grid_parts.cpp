#include "polestar/vdb/detail/grid_parts.h"

#include <sstream>

namespace polestar::detail {

// As if read from a file. OpenVDB's constructors refuse scales whose cube is below 3e-15, as if they were
// zero, and round others on the way through a matrix; the map itself and the format work at any scale.
openvdb::math::Transform::Ptr makeUniformTransform(double scale, const Vec3& translation) {
  using openvdb::Vec3d;
  const Vec3d shift(translation.x(), translation.y(), translation.z()), forward(scale), inverse(1 / scale);
  std::stringstream bytes;
  openvdb::writeString(bytes, openvdb::math::UniformScaleTranslateMap::mapType());
  for (const Vec3d& part : {shift, forward, forward, inverse, inverse * inverse, inverse / 2})
    part.write(bytes);
  openvdb::io::setCurrentVersion(bytes);
  const auto transform = std::make_shared<openvdb::math::Transform>();
  transform->read(bytes);
  return transform;
}

}  // namespace polestar::detail
