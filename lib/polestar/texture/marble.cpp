// Marble: white calcite with clouds, and gray veins along folds of a warped space.

#include "polestar/io/picture.h"
#include "polestar/texture/detail/noise.h"
#include "polestar/texture/detail/point_texture.h"
#include "polestar/texture/detail/procedural_texture.h"
#include "polestar/texture/detail/ramp.h"

namespace polestar::detail {
namespace {

const Vec3f kGrayVein = linearFromSrgb(0x4c5057), kBrownVein = linearFromSrgb(0x9a7b4f),
            kVeinHalo = linearFromSrgb(0x9da0a4);

class Marble final : public PointTexture {
 public:
  explicit Marble(const Parameters& p)
      : scale_(p["scale"]),
        warp_(p["warp"]),
        veins_(p["veins"]),
        thickness_(p["thickness"]),
        gold_(p["gold"]),
        polish_(p["polish"]),
        seed_(p.seed()),
        ground_({{-2.5, 0xc9cacb}, {-0.8, 0xdfdfdd}, {0.5, 0xecebe7}, {2.5, 0xf6f5f1}}) {}

 private:
  TextureSample at(const Place& place) const override {
    const Footprint& footprint = place.footprint;
    const VaryingPoint p = (1 / scale_) * place.ball;
    const Footprint inFolds = footprint.scaled(1 / scale_);
    const Octaves octaves{0.7, 2, 0.45};
    const Varying bendX = fractalNoise(p, inFolds, octaves, seed_),
                  bendY = fractalNoise(p, inFolds, octaves, seed_ + 1);
    const VaryingPoint bent(p.x + 0.16 * warp_ * bendX, p.y + 0.16 * warp_ * bendY,
                            p.z + 0.11 * warp_ * (bendX - bendY));

    // Veins run along sheets: the noise is drawn out across one direction, and across another.
    const VaryingPoint wide = sheets(bent, Vec3(0.75, 0.45, -0.48).normalized(), 0.62, 0.15);
    const Varying folds = fractalNoise(wide, footprint.in(wide), {1, 5, 0.54}, seed_ + 2);
    const VaryingPoint narrow = sheets(bent, Vec3(-0.35, 0.8, 0.5).normalized(), 1.3, 0.5);
    const Varying cracks = fractalNoise(narrow, footprint.in(narrow), {1, 4, 0.55}, seed_ + 3);
    TextureSample sample;
    const Varying cloud = 0.7 * bendX + 0.5 * folds + 0.3 * cracks;
    sample.color = ground_.mean(cloud, footprint);

    // A vein is where a noise is near 0; its strength comes and goes along it.
    const double strength = 0.35 + 0.65 * smoothStep(-1.2, 1.2, bendY.value);
    const double halo = shareWithin(folds, 0.2 * thickness_, 0.6 * thickness_, footprint);
    const double core = shareWithin(folds, 0.05 * thickness_, 0.1 * thickness_, footprint);
    const double fine = shareWithin(cracks, 0.045 * thickness_, 0.12 * thickness_, footprint);
    const Vec3f veinColor = mix(kGrayVein, kBrownVein, gold_ * smoothStep(-0.5, 1.5, bendX.value));
    sample.color = mix(sample.color, kVeinHalo, 0.6 * veins_ * strength * halo);
    sample.color = mix(sample.color, veinColor, std::min(1.0, veins_ * strength) * 0.95 * core);
    const double sparse = smoothStep(0.0, 1.4, bendX.value - 0.3 * bendY.value);
    sample.color = mix(sample.color, veinColor, std::min(1.0, veins_) * 0.5 * sparse * fine);
    sample.gloss = static_cast<float>(polish_);
    return sample;
  }

  /// Frequency `across` along `normal`, `along` in the plane square to it.
  static VaryingPoint sheets(const VaryingPoint& p, const Vec3& normal, double across, double along) {
    const Varying height = normal[0] * p.x + normal[1] * p.y + normal[2] * p.z;
    const Varying lift = (across - along) * height;
    return {along * p.x + normal[0] * lift, along * p.y + normal[1] * lift, along * p.z + normal[2] * lift};
  }

  double scale_, warp_, veins_, thickness_, gold_, polish_;
  std::uint32_t seed_;
  Ramp ground_;
};

}  // namespace

ProceduralTexture marble() {
  return {{"marble",
           "white marble: clouds and gray veins in a folded space",
           {{"scale", 0.55, 0.05, 5, "size of the folds"},
            {"warp", 1, 0, 4, "how much the veins are folded"},
            {"veins", 0.9, 0, 1.5, "strength of the veins"},
            {"thickness", 1, 0.1, 4, "thickness of the veins, over that of the default"},
            {"gold", 0.35, 0, 1, "brown in the gray of the veins"},
            {"polish", 0.8, 0, 1, "gloss of the surface"},
            kSeedParameter}},
          makeOf<Marble>};
}

}  // namespace polestar::detail
