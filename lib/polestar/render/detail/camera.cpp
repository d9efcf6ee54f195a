#include "polestar/render/detail/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace polestar::detail {

Camera::Camera(const Vec3& view, const Vec3& up, double fieldOfView, int width, int height, double margin,
               std::span<const Vec3> points)
    : forward_(view.normalized()),
      right_(forward_.cross(up).normalized()),
      up_(right_.cross(forward_)),
      tangent_(std::tan(0.5 * fieldOfView)),
      width_(width),
      height_(height) {
  // A point p is seen within the tangents when |axis . (p - c)| <= tangent * forward . (p - c) for both axes:
  // four linear conditions on the camera's position c. Opposite ones together bound forward . c, their mean
  // centers the picture.
  const double share = 1 - 2 * margin;
  double depth = std::numeric_limits<double>::infinity();
  double offset[2];
  const Vec3* axes[2] = {&right_, &up_};
  for (int k = 0; k < 2; ++k) {
    const double tangent = share * tangent_ * (k == 0 ? static_cast<double>(width) / height : 1);
    double above = -std::numeric_limits<double>::infinity(), below = above;
    for (const Vec3& p : points) {
      above = std::max(above, axes[k]->dot(p) - tangent * forward_.dot(p));
      below = std::max(below, -axes[k]->dot(p) - tangent * forward_.dot(p));
    }
    depth = std::min(depth, -(above + below) / (2 * tangent));
    offset[k] = 0.5 * (above - below);
  }
  position_ = depth * forward_ + offset[0] * right_ + offset[1] * up_;
}

Ray Camera::ray(double x, double y) const {
  const double a = tangent_ * (2 * x - width_) / height_, b = tangent_ * (height_ - 2 * y) / height_;
  return {position_, (forward_ + a * right_ + b * up_).normalized()};
}

Eigen::Vector2d Camera::project(const Vec3& point) const {
  const Vec3 d = point - position_;
  const double scale = height_ / (2 * tangent_ * forward_.dot(d));
  return {0.5 * width_ + scale * right_.dot(d), 0.5 * height_ - scale * up_.dot(d)};
}

}  // namespace polestar::detail
