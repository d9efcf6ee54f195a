#include "polestar/map/detail/direction_map.h"

namespace polestar::detail {

DirectionMap::DirectionMap(std::span<const Vec3> omega, std::span<const Vec3> phi,
                           const std::vector<Triangle>& triangles)
    : locator_(omega, triangles),
      triangles_(triangles),
      omega_(omega.begin(), omega.end()),
      phi_(phi.begin(), phi.end()),
      slope_(omega.size()) {
  std::vector<TangentFit> fits(omega_.begin(), omega_.end());
  for (const Triangle& t : triangles_) {
    for (int k = 0; k < 3; ++k) {
      const std::int32_t i = t[k], j = t[(k + 1) % 3];
      fits[i].add(omega_[j] - omega_[i], phi_[j] - phi_[i]);
    }
  }
  for (std::size_t i = 0; i < fits.size(); ++i) slope_[i] = fits[i].slope();
}

std::optional<Vec3> DirectionMap::operator()(const Vec3& omega) const {
  const auto cell = locator_.locate(omega);
  if (!cell) return std::nullopt;
  const Triangle& t = triangles_[cell->triangle];
  Vec3 flat = Vec3::Zero();
  for (int k = 0; k < 3; ++k) flat += cell->weights[k] * omega_[t[k]];
  // A corner without a slope takes that of the linear map; the sum of weight * linear slope * offset is 0, so
  // what the others have in excess of it is to be added.
  const Vec3 a = omega_[t[1]] - omega_[t[0]], b = omega_[t[2]] - omega_[t[0]], normal = a.cross(b);
  const double squared = normal.squaredNorm();
  const Mat3 linear = ((phi_[t[1]] - phi_[t[0]]) * b.cross(normal).transpose() +
                       (phi_[t[2]] - phi_[t[0]]) * normal.cross(a).transpose()) /
                      squared;
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    sum += cell->weights[k] * phi_[t[k]];
    if (const auto& slope = slope_[t[k]])
      sum += 0.5 * slope->trust * cell->weights[k] * ((slope->slope - linear) * (flat - omega_[t[k]]));
  }
  return sum.normalized();
}

}  // namespace polestar::detail
