#pragma once
// A pinhole camera that frames a set of points.

#include <span>
#include <vector>

#include "polestar/io/picture.h"
#include "polestar/render/detail/ray_bundle.h"

namespace polestar::detail {

/// Looks along `view` with `up` upwards in the picture.
struct CameraPose {
  Vec3 view, up;
  double fieldOfView;  ///< vertical, radians
  int width, height;   ///< pixels
  double margin;       ///< share of the width and of the height left free on each side
};

class Camera {
 public:
  /// From where `points` fill the frame but for the margin. The fit is exact, for perspective too. `turns`:
  /// the points have to fit at each of these angles (radians) about the axis `up` through `pivot`.
  Camera(const CameraPose& pose, std::span<const Vec3> points, std::span<const double> turns = {},
         const Vec3& pivot = Vec3::Zero());

  /// The camera that sees what this one sees of a solid turned by `angle` about `axis` through `pivot`.
  Camera around(const Vec3& axis, const Vec3& pivot, double angle) const;

  /// Through continuous pixel coordinates, (0, 0) the upper left corner of the picture; unit length.
  Vec3 direction(double x, double y) const;
  /// Rays from the camera through many places.
  void rays(std::span<const float> x, std::span<const float> y, RayBundle& bundle) const;
  /// Pixel coordinates of a point in front of the camera.
  Eigen::Vector2d project(const Vec3& point) const;
  /// Size of a pixel at `depth` along the view direction.
  double pixelSize(double depth) const { return depth * 2 * tangent_ / height_; }
  /// For the metadata of pictures; in mesh units, where a point p of this frame is origin + unit * p.
  Picture::Camera matrices(const Vec3& origin, double unit) const;
  double depth(const Vec3& point) const { return forward_.dot(point - position_); }

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
