#include "polestar/render/detail/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "polestar/core/detail/simd.h"

namespace polestar::detail {
namespace {

/// Directions are corner + x across + y down.
struct Form {
  float from[3], corner[3], across[3], down[3];
};

POLESTAR_SIMD_CLONES
void fillRays(const Form form, std::size_t count, const float* x, const float* y, float* const* origin,
              float* const* direction) {
  for (int k = 0; k < 3; ++k) std::fill_n(origin[k], count, form.from[k]);
  float* __restrict dx = direction[0], * __restrict dy = direction[1], * __restrict dz = direction[2];
  for (std::size_t i = 0; i < count; ++i) {
    const float a = form.corner[0] + x[i] * form.across[0] + y[i] * form.down[0],
                b = form.corner[1] + x[i] * form.across[1] + y[i] * form.down[1],
                c = form.corner[2] + x[i] * form.across[2] + y[i] * form.down[2];
    const float inverse = 1 / std::sqrt(a * a + b * b + c * c);
    dx[i] = a * inverse;
    dy[i] = b * inverse;
    dz[i] = c * inverse;
  }
}

}  // namespace

Camera::Camera(const CameraPose& pose, std::span<const Vec3> points, std::span<const double> turns,
               const Vec3& pivot)
    : forward_(pose.view.normalized()),
      right_(forward_.cross(pose.up).normalized()),
      up_(right_.cross(forward_)),
      tangent_(std::tan(0.5 * pose.fieldOfView)),
      width_(pose.width),
      height_(pose.height) {
  // A point p is seen within the tangents when |axis . (p - c)| <= tangent * forward . (p - c) for both axes:
  // four linear conditions on the camera's position c. Opposite ones together bound forward . c, their mean
  // centers the picture.
  const double share = 1 - 2 * pose.margin;
  const double tangents[2] = {share * tangent_ * width_ / height_, share * tangent_};
  const Vec3* axes[2] = {&right_, &up_};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double above[2] = {-kInfinity, -kInfinity}, below[2] = {-kInfinity, -kInfinity};
  const double still = 0;
  for (const double turn : turns.empty() ? std::span<const double>(&still, 1) : turns) {
    // Turning the axes the other way is turning the points.
    const Mat3 back = Eigen::AngleAxisd(-turn, pose.up.normalized()).toRotationMatrix();
    for (int k = 0; k < 2; ++k) {
      const Vec3 upper = *axes[k] - tangents[k] * forward_, lower = -*axes[k] - tangents[k] * forward_;
      const Vec3 turnedUpper = back * upper, turnedLower = back * lower;
      const double atUpper = upper.dot(pivot) - turnedUpper.dot(pivot),
                   atLower = lower.dot(pivot) - turnedLower.dot(pivot);
      for (const Vec3& p : points) {
        above[k] = std::max(above[k], turnedUpper.dot(p) + atUpper);
        below[k] = std::max(below[k], turnedLower.dot(p) + atLower);
      }
    }
  }
  const double depth =
      std::min(-(above[0] + below[0]) / (2 * tangents[0]), -(above[1] + below[1]) / (2 * tangents[1]));
  position_ = depth * forward_ + 0.5 * (above[0] - below[0]) * right_ + 0.5 * (above[1] - below[1]) * up_;
}

Camera Camera::around(const Vec3& axis, const Vec3& pivot, double angle) const {
  const Mat3 back = Eigen::AngleAxisd(-angle, axis.normalized()).toRotationMatrix();
  Camera camera = *this;
  camera.position_ = pivot + back * (position_ - pivot);
  camera.forward_ = back * forward_;
  camera.right_ = back * right_;
  camera.up_ = back * up_;
  return camera;
}

Vec3 Camera::direction(double x, double y) const {
  const double a = tangent_ * (2 * x - width_) / height_, b = tangent_ * (height_ - 2 * y) / height_;
  return (forward_ + a * right_ + b * up_).normalized();
}

void Camera::rays(std::span<const float> x, std::span<const float> y, RayBundle& bundle) const {
  bundle.resize(x.size());
  const auto scale = static_cast<float>(2 * tangent_ / height_);
  const Vec3f from = position_.cast<float>(), across = scale * right_.cast<float>(),
              down = -scale * up_.cast<float>();
  const Vec3f corner = forward_.cast<float>() - 0.5f * static_cast<float>(width_) * across -
                       0.5f * static_cast<float>(height_) * down;
  const Form form{{from[0], from[1], from[2]},
                  {corner[0], corner[1], corner[2]},
                  {across[0], across[1], across[2]},
                  {down[0], down[1], down[2]}};
  float* origin[3];
  float* direction[3];
  for (int k = 0; k < 3; ++k) {
    origin[k] = bundle.origin[k].data();
    direction[k] = bundle.direction[k].data();
  }
  fillRays(form, x.size(), x.data(), y.data(), origin, direction);
}

Eigen::Vector2d Camera::project(const Vec3& point) const {
  const Vec3 d = point - position_;
  const double scale = height_ / (2 * tangent_ * forward_.dot(d));
  return {0.5 * width_ + scale * right_.dot(d), 0.5 * height_ - scale * up_.dot(d)};
}

Picture::Camera Camera::matrices(const Vec3& origin, double unit) const {
  Picture::Camera camera;
  const Vec3 position = origin + unit * position_;
  const Vec3* axes[3] = {&right_, &up_, &forward_};
  for (std::size_t column = 0; column < 3; ++column) {
    const Vec3& axis = *axes[column];
    for (std::size_t row = 0; row < 3; ++row)
      camera.worldToCamera[4 * row + column] = static_cast<float>(axis[static_cast<Eigen::Index>(row)]);
    camera.worldToCamera[12 + column] = static_cast<float>(-axis.dot(position));
  }
  camera.worldToCamera[15] = 1;
  // Across and up by the tangents; depth is divided by, and stays as it is beside that.
  const double scales[3] = {height_ / (tangent_ * width_), 1 / tangent_, 1};
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t c = 0; c < 3; ++c)
      camera.worldToScreen[4 * row + c] = static_cast<float>(scales[c]) * camera.worldToCamera[4 * row + c];
    camera.worldToScreen[4 * row + 3] = camera.worldToCamera[4 * row + 2];
  }
  return camera;
}

}  // namespace polestar::detail
