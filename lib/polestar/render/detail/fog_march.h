#pragma once
// One ray through a fog.

#include <vector>

#include "polestar/render/detail/plane.h"
#include "polestar/vdb/fog_volume.h"

namespace polestar::detail {

/// World units throughout.
struct FogMedium {
  const FogVolume& fog;
  double extinction;                     ///< 1 / length, of density 1
  double step;                           ///< length, of camera rays
  std::vector<std::vector<Plane>> gone;  ///< convex regions (inner sides) in which there is no fog
};

/// For one thread.
class FogMarch {
 public:
  explicit FogMarch(const FogMedium& medium) : medium_(medium), probe_(medium.fog) {}

  /// Share of light that gets from `origin` to infinity; `jitter` in [0, 1) shifts the steps, which are
  /// `stretch` times the medium's. Below 1e-3 it is 0.
  double transmittance(const Vec3& origin, const Vec3& direction, double jitter, double stretch);

  /// Marches as transmittance() does, and remembers the way.
  double follow(const Vec3& origin, const Vec3& direction, double jitter);
  /// Where on the last way followed light is scattered: the place up to which `share`, in [0, 1), of what is
  /// scattered at all has been.
  double scatterDistance(double share) const;

  FogProbe& probe() { return probe_; }

 private:
  struct Step {
    double begin, end, depth;  ///< distances; optical depth at the end
  };
  template <class Visit>
  void march(const Vec3& origin, const Vec3& direction, double jitter, double step, const Visit& visit);
  bool isGone(const Vec3& point) const;

  const FogMedium& medium_;
  FogProbe probe_;
  std::vector<FogSpan> spans_;
  std::vector<Step> way_;
};

}  // namespace polestar::detail
