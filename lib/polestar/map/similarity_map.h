#pragma once
// A body that lies in the world turned, scaled and moved: the map into its own frame.

#include "polestar/map/volume_map.h"

namespace polestar {

/// forward(x) = axes^T (x - origin) / unit, everywhere.
class SimilarityMap final : public VolumeMap {
 public:
  /// `axes`: columns, the frame's axes in the world; orthogonal. `unit`: of the frame, in mesh units, > 0.
  SimilarityMap(const Vec3& origin, const Mat3& axes, double unit)
      : origin_(origin), axes_(axes), unit_(unit) {}

  Vec3 toFrame(const Vec3& world) const { return axes_.transpose() * (world - origin_) / unit_; }
  Vec3 toWorld(const Vec3& frame) const { return origin_ + unit_ * (axes_ * frame); }

  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override;
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override;
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override;

 private:
  Vec3 origin_;
  Mat3 axes_;
  double unit_;
};

}  // namespace polestar
