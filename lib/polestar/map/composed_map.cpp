#include "polestar/map/composed_map.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <numbers>
#include <utility>

namespace polestar {

ComposedMap& ComposedMap::thenForward(std::shared_ptr<const VolumeMap> map) {
  links_.push_back({std::move(map), false});
  return *this;
}

ComposedMap& ComposedMap::thenInverse(std::shared_ptr<const VolumeMap> map) {
  links_.push_back({std::move(map), true});
  return *this;
}

ComposedMap& ComposedMap::thenRotate(const Mat3& rotation) {
  links_.push_back({nullptr, false, rotation});
  return *this;
}

ComposedMap ComposedMap::inverted() const {
  ComposedMap result;
  for (auto link = links_.rbegin(); link != links_.rend(); ++link) {
    result.links_.push_back({link->map, !link->backward, link->rotation.transpose()});
  }
  return result;
}

void ComposedMap::forward(std::span<const Vec3> in, std::span<Vec3> out) const {
  std::vector<Vec3> at(in.begin(), in.end()), next(in.size());
  for (const Link& link : links_) {
    if (!link.map) {
      for (Vec3& point : at) point = link.rotation * point;
      continue;
    }
    if (link.backward) {
      link.map->inverse(at, next);
    } else {
      link.map->forward(at, next);
    }
    at.swap(next);
  }
  std::copy(at.begin(), at.end(), out.begin());
}

void ComposedMap::inverse(std::span<const Vec3> out, std::span<Vec3> in) const {
  inverted().forward(out, in);
}

void ComposedMap::jacobian(std::span<const Vec3> in, std::span<Mat3> derivative) const {
  std::vector<Vec3> at(in.begin(), in.end()), next(in.size());
  std::vector<Mat3> own(in.size());
  std::fill(derivative.begin(), derivative.end(), Mat3::Identity());
  for (const Link& link : links_) {
    if (!link.map) {
      for (Vec3& point : at) point = link.rotation * point;
      for (Mat3& d : derivative) d = link.rotation * d;
      continue;
    }
    if (link.backward) {
      link.map->inverse(at, next);
      link.map->jacobian(next, own);
    } else {
      link.map->forward(at, next);
      link.map->jacobian(at, own);
    }
    for (std::size_t i = 0; i < own.size(); ++i) {
      derivative[i] = link.backward ? Mat3(own[i].inverse() * derivative[i]) : Mat3(own[i] * derivative[i]);
    }
    at.swap(next);
  }
}

Mat3 rotationXyz(const Vec3& degrees) {
  const Vec3 angles = degrees * (std::numbers::pi / 180);
  return (Eigen::AngleAxisd(angles.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(angles.y(), Vec3::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Vec3::UnitX()))
      .toRotationMatrix();
}

}  // namespace polestar
