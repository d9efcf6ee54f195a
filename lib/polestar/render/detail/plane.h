#pragma once
// Half-spaces and what rays have in common with several of them.

#include <cstdint>
#include <span>
#include <vector>

#include "polestar/render/detail/ray_bundle.h"

namespace polestar::detail {

/// Points x with normal . x > offset are on the plane's outer side.
struct Plane {
  Vec3 normal = Vec3::UnitZ();
  double offset = 0;

  double height(const Vec3& point) const { return normal.dot(point) - offset; }
};

/// The parts of rays (distance >= 0) on the inner side of all planes: empty unless begin < end.
struct ConvexIntervals {
  std::vector<float> begin, end;
  std::vector<std::int32_t> entry, exit;  ///< the planes that bound them, -1 for the ray's own ends

  /// `shift`: the planes are moved by it.
  ConvexIntervals(std::span<const Plane> planes, const Vec3& shift, const RayBundle& rays);
  bool empty(std::size_t ray) const { return !(begin[ray] < end[ray]); }
};

}  // namespace polestar::detail
