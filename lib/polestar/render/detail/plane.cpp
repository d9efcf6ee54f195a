#include "polestar/render/detail/plane.h"

#include <limits>

#include "polestar/core/detail/simd.h"

namespace polestar::detail {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Form {
  float x, y, z, offset;
};

/// Clips the intervals of all rays by one plane.
POLESTAR_SIMD_CLONES
void clip(const Form plane, std::int32_t number, std::size_t count, const float* const* origin,
          const float* const* direction, float* __restrict begin, float* __restrict end,
          std::int32_t* __restrict entry, std::int32_t* __restrict exit) {
  const float *ox = origin[0], *oy = origin[1], *oz = origin[2];
  const float *dx = direction[0], *dy = direction[1], *dz = direction[2];
  for (std::size_t i = 0; i < count; ++i) {
    const float height = plane.x * ox[i] + plane.y * oy[i] + plane.z * oz[i] - plane.offset;
    const float speed = plane.x * dx[i] + plane.y * dy[i] + plane.z * dz[i];
    const float crossing = -height / speed;
    const float along = height > 0 ? -1.0f : kInfinity;  // of a ray along the plane
    const float enters = speed < 0 ? crossing : -1.0f;
    const float leaves = speed > 0 ? crossing : (speed < 0 ? kInfinity : along);
    entry[i] = enters > begin[i] ? number : entry[i];
    begin[i] = enters > begin[i] ? enters : begin[i];
    exit[i] = leaves < end[i] ? number : exit[i];
    end[i] = leaves < end[i] ? leaves : end[i];
  }
}

}  // namespace

ConvexIntervals::ConvexIntervals(std::span<const Plane> planes, const Vec3& shift, const RayBundle& rays)
    : begin(rays.size(), 0.0f), end(rays.size(), kInfinity), entry(rays.size(), -1), exit(rays.size(), -1) {
  const float* origin[3];
  const float* direction[3];
  for (int k = 0; k < 3; ++k) {
    origin[k] = rays.origin[k].data();
    direction[k] = rays.direction[k].data();
  }
  for (std::size_t p = 0; p < planes.size(); ++p) {
    const Vec3f normal = planes[p].normal.cast<float>();
    const Form form{normal[0], normal[1], normal[2],
                    static_cast<float>(planes[p].offset + planes[p].normal.dot(shift))};
    clip(form, static_cast<std::int32_t>(p), rays.size(), origin, direction, begin.data(), end.data(),
         entry.data(), exit.data());
  }
}

}  // namespace polestar::detail
