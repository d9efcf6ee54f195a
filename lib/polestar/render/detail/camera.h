#pragma once
// A pinhole camera that frames a set of points.

#include <span>

#include "polestar/render/detail/cut_scene.h"

namespace polestar::detail {

class Camera {
 public:
  /// Looks along `view` with `up` upwards in the picture, from where `points` fill the frame but for `margin`
  /// (share of the width and of the height left free on each side). The fit is exact, for perspective too.
  Camera(const Vec3& view, const Vec3& up, double fieldOfView, int width, int height, double margin,
         std::span<const Vec3> points);

  /// Through continuous pixel coordinates, (0, 0) the upper left corner of the picture.
  Ray ray(double x, double y) const;
  /// Pixel coordinates of a point in front of the camera.
  Eigen::Vector2d project(const Vec3& point) const;
  /// Size of a pixel at `distance`.
  double pixelSize(double distance) const { return distance * 2 * tangent_ / height_; }

  const Vec3& position() const { return position_; }
  const Vec3& forward() const { return forward_; }
  const Vec3& right() const { return right_; }
  const Vec3& up() const { return up_; }

 private:
  Vec3 position_, forward_, right_, up_;
  double tangent_;  ///< of half the vertical field of view
  int width_, height_;
};

}  // namespace polestar::detail
