#pragma once
// Maps of volumes one behind the other: from a solid to the ball, turned, and on into another solid. What
// `warp` sends its points through.

#include <memory>
#include <vector>

#include "polestar/map/volume_map.h"

namespace polestar {

/// A chain of maps, each taken forward or backward, with turns between them. Without links: the identity.
/// What is nowhere for one link is NaN for the chain. Cheap to copy; frames are those of the first link's
/// input and the last one's output.
class ComposedMap final : public VolumeMap {
 public:
  ComposedMap& thenForward(std::shared_ptr<const VolumeMap> map);
  ComposedMap& thenInverse(std::shared_ptr<const VolumeMap> map);
  /// `rotation`: orthogonal; about the origin, so between maps about the ball's center.
  ComposedMap& thenRotate(const Mat3& rotation);

  /// The same chain the other way round.
  ComposedMap inverted() const;

  void forward(std::span<const Vec3> in, std::span<Vec3> out) const override;
  void inverse(std::span<const Vec3> out, std::span<Vec3> in) const override;
  /// By the chain rule from the links' own derivatives.
  void jacobian(std::span<const Vec3> in, std::span<Mat3> derivative) const override;

 private:
  struct Link {
    std::shared_ptr<const VolumeMap> map;  ///< null: the rotation
    bool backward = false;
    Mat3 rotation = Mat3::Identity();
  };
  std::vector<Link> links_;
};

/// Turn by the angles (degrees) about x, then y, then z, axes fixed.
Mat3 rotationXyz(const Vec3& degrees);

}  // namespace polestar
