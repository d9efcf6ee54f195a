#pragma once
// A solid texture that is written point by point.

#include <array>

#include "polestar/texture/detail/footprint.h"
#include "polestar/texture/solid_texture.h"

namespace polestar::detail {

/// Where a texture is asked for.
struct Place {
  VaryingPoint ball;
  Varying radius;       ///< mean over the footprint
  Footprint footprint;  ///< in ball coordinates
  TexturePoint point;   ///< what was asked for

  explicit Place(const TexturePoint& point);
};

/// The eight halves of a place's footprint along its three edges; for patterns that are neither smaller nor
/// much larger than it.
std::array<TexturePoint, 8> octants(const TexturePoint& point);

class PointTexture : public SolidTexture {
 public:
  void sample(std::span<const TexturePoint> points, std::span<TextureSample> samples) const final;

 private:
  virtual TextureSample at(const Place& place) const = 0;
};

/// One with a grain.
class FiberTexture : public PointTexture {
 public:
  bool hasFiber() const final { return true; }
  void fiber(std::span<const Vec3> ball, std::span<Vec3> direction) const final;

 private:
  virtual Vec3 fiberAt(const Vec3& ball) const = 0;
};

}  // namespace polestar::detail
