#pragma once
// The light in which the solid stands: a large soft key light, a dome, a floor that melts into the
// background. What light arrives is told to it; rays are traced elsewhere, by the thousand.

#include <Eigen/Core>
#include <optional>

#include "polestar/render/detail/camera.h"

namespace polestar::detail {

using DiskPoint = Eigen::Vector2f;  ///< a random point of the unit disk

struct StudioSettings {
  Vec3 up = Vec3::UnitZ();  ///< away from the floor
  double floor = 0;         ///< which lies at up . x = floor
  bool hasFloor = true;
  double keySide = 1;  ///< the key light stands at the camera's right (> 0) or left
  double keySize = 1;  ///< its size, 1: a soft window
  Vec3f background = Vec3f::Ones();
  bool transparent = false;  ///< nothing behind the solid but its shadow
};

/// What a light path brought: did the key light, or the dome in this direction, reach the point?
struct LightSeen {
  Vec3f toKey, toDome;
  bool key = false, dome = false;
};

/// Light from the solid towards the viewer is albedo * diffuse + gloss * sheen.
struct SolidLight {
  Vec3f diffuse = Vec3f::Zero();
  float sheen = 0;
};

/// Radiances are relative to a white matte surface that faces the key light: that one is about 1. The lights
/// follow the camera around. Immutable.
class Studio {
 public:
  Studio(const Camera& camera, const StudioSettings& settings);

  /// A direction to a random point of the key light.
  Vec3f keyDirection(const DiskPoint& sample) const;
  /// A random direction about `normal`, by the cosine.
  static Vec3f domeDirection(const Vec3f& normal, const DiskPoint& sample);

  SolidLight onSolid(const Vec3f& normal, const Vec3f& toViewer, const LightSeen& seen) const;
  /// A random direction, all alike.
  static Vec3f sphereDirection(const DiskPoint& sample);
  /// Light from a point in a white fog that sends it on in all directions alike: of the key and of the dome
  /// in direction `toDome`, the shares (0 to 1) arrive at the point.
  Vec3f inFog(float keyShare, const Vec3f& toDome, float domeShare) const;

  /// Where a ray that misses the solid meets the floor, if it does.
  std::optional<Vec3f> floorPoint(const Vec3f& origin, const Vec3f& direction) const;
  Vec3f floorNormal() const { return up_; }
  /// What such a ray sees, premultiplied color and alpha: background, shaded where light to the floor is
  /// lost (shares 0 to 1). `vignette` is the distance from the picture's middle, 1 at its corners.
  Eigen::Vector4f backdrop(float vignette, float keyLost, float domeLost) const;

 private:
  float domeRadiance(const Vec3f& direction) const;

  StudioSettings settings_;
  Vec3f up_, key_, keyRight_, keyUp_, rim_;
};

}  // namespace polestar::detail
