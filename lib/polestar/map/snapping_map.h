#pragma once
// A ball map for points that are meant to lie ON the surface and miss it by rounding, as the boundary
// vertices of a tetrahedral mesh do.

#include <atomic>
#include <memory>

#include "polestar/map/ball_map.h"
#include "polestar/map/surface_points.h"

namespace polestar {

/// Answers as `map` does; points outside by up to `reach` are taken for the points of the surface below them,
/// along the ray from the center. Where a traced map has no answer for a point inside (it begins at the
/// surface, or a trace failed), the table's stands in. Frames as in BallMap.
class SnappingMap final : public VolumeMap {
 public:
  /// `relativeReach`: in diagonals of the surface's box on the solid's side, of the ball's box (2 sqrt 3) on
  /// the other; not negative.
  /// @throws Error{Errc::usage}
  SnappingMap(BallMap table, std::shared_ptr<const VolumeMap> map, double relativeReach);

  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override;
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override;
  /// On the surface and outside within reach: the derivative just below.
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override;

  /// How far outside points lie, along the ray from the center; 0 inside, NaN for what is no point.
  void outsideSolid(std::span<const Vec3> solid, std::span<double> distance) const;  ///< mesh units
  static void outsideBall(std::span<const Vec3> domain, std::span<double> distance);

  double solidReach() const { return solidReach_; }  ///< mesh units
  double ballReach() const { return ballReach_; }
  /// Points inside so far that the table answered in place of `map`.
  std::size_t answeredByTable() const { return answeredByTable_; }

 private:
  BallMap table_;
  std::shared_ptr<const VolumeMap> map_;
  SurfacePoints surface_;
  Vec3 center_;
  double solidReach_, ballReach_;
  mutable std::atomic<std::size_t> answeredByTable_{0};
};

}  // namespace polestar
