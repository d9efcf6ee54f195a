#include "polestar/map/similarity_map.h"

#include <algorithm>

namespace polestar {

void SimilarityMap::forward(std::span<const Vec3> solid, std::span<Vec3> domain) const {
  std::transform(solid.begin(), solid.end(), domain.begin(), [this](const Vec3& x) { return toFrame(x); });
}

void SimilarityMap::inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const {
  std::transform(domain.begin(), domain.end(), solid.begin(), [this](const Vec3& x) { return toWorld(x); });
}

void SimilarityMap::jacobian(std::span<const Vec3>, std::span<Mat3> derivative) const {
  std::fill(derivative.begin(), derivative.end(), Mat3(axes_.transpose() / unit_));
}

}  // namespace polestar
