#pragma once
// Solid textures whose pictures are known beforehand.

#include <memory>

#include "polestar/render/mapped_appearance.h"

namespace polestar::testing {

/// Ball coordinates as colors: (1 + ball) / 2. Linear, so averages over pixels are the colors in their
/// middles.
class BallColors final : public SolidTexture {
 public:
  static Vec3f color(const Vec3& ball) { return (0.5 * (ball + Vec3::Ones())).cast<float>(); }
  void sample(std::span<const TexturePoint> points, std::span<TextureSample> samples) const override {
    for (std::size_t i = 0; i < points.size(); ++i) samples[i] = {color(points[i].ball), 0, Vec3::Zero()};
  }
};

/// One color and gloss.
class Plain final : public SolidTexture {
 public:
  explicit Plain(float albedo, float gloss = 0) : albedo_(albedo), gloss_(gloss) {}
  void sample(std::span<const TexturePoint>, std::span<TextureSample> samples) const override {
    for (TextureSample& sample : samples) sample = {Vec3f::Constant(albedo_), gloss_, Vec3::Zero()};
  }

 private:
  float albedo_, gloss_;
};

/// Without iso-lines; the map outlives the result.
inline std::unique_ptr<Appearance> appearanceOf(const VolumeMap& map,
                                                std::shared_ptr<const SolidTexture> texture) {
  MappedLook look;
  look.texture = std::move(texture);
  return makeMappedAppearance(map, nullptr, look);
}

}  // namespace polestar::testing
