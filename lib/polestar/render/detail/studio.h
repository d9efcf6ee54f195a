#pragma once
// The light in which the solid stands: a large soft key light, a dome, a floor that melts into the
// background.

#include <Eigen/Core>

#include "polestar/render/detail/camera.h"

namespace polestar::detail {

/// Random numbers of one camera sample, each in [0, 1).
struct LightSample {
  Eigen::Vector2d key, dome;
};

/// What the light falls on.
struct Material {
  Vec3f albedo = Vec3f::Ones();
  float gloss = 0;  ///< 0: matte, 1: the strength of a dielectric coat (4 % at normal incidence)
};

/// All radiances are relative to a white matte surface that faces the key light: that one is about 1.
class Studio {
 public:
  /// `up` is away from the floor, which lies at up . x = floor. The lights follow the camera around, the key
  /// light from its right (keySide > 0) or left.
  Studio(const Camera& camera, const Vec3& up, double floor, double keySide, const Vec3f& background);

  /// Light from a point of the solid towards `toViewer`.
  Vec3f shadeSolid(const CutScene& scene, const SolidHit& hit, const Vec3& normal, const Material& material,
                   const Vec3& toViewer, const LightSample& sample) const;

  /// What the ray sees when it misses the solid: background, shaded where the solid keeps light from the
  /// floor. `vignette` is the distance from the picture's middle, 1 at its corners.
  Vec3f shadeBackdrop(const CutScene& scene, const Ray& ray, double vignette,
                      const LightSample& sample) const;

  Vec3f backdrop(double vignette) const;

 private:
  Vec3 keyDirection(const Eigen::Vector2d& sample) const;
  double domeRadiance(const Vec3& direction) const;

  Vec3 up_, key_, keyRight_, keyUp_, rim_;
  double floor_;
  Vec3f background_;
};

}  // namespace polestar::detail
