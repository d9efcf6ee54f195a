// Granite: interlocked grains of feldspar, quartz and black mica.

#include "polestar/io/picture.h"
#include "polestar/texture/detail/cells.h"
#include "polestar/texture/detail/hash.h"
#include "polestar/texture/detail/noise.h"
#include "polestar/texture/detail/point_texture.h"
#include "polestar/texture/detail/procedural_texture.h"
#include "polestar/texture/detail/ramp.h"

namespace polestar::detail {
namespace {

/// Places for small flakes along a grain, and how many hold one, over the share of mica.
constexpr double kFlakes = 2.6, kFlakesShare = 0.55;

class Granite final : public PointTexture {
 public:
  explicit Granite(const Parameters& p)
      : grain_(p["grain"]),
        quartzShare_(p["quartz"]),
        micaShare_(p["mica"]),
        pink_(p["pink"]),
        polish_(p["polish"]),
        seed_(p.seed()),
        feldspar_({{0, 0xb9b1a6}, {0.5, 0xd6cfc5}, {1, 0xefe9e0}}),
        pinkFeldspar_({{0, 0xb08470}, {0.5, 0xcda08b}, {1, 0xe3bfac}}),
        quartz_({{0, 0x77767a}, {0.5, 0x9c9a98}, {1, 0xc4c0ba}}),
        mica_({{0, 0x1a1a1c}, {0.7, 0x303032}, {1, 0x65625d}}),
        mean_(measuredMean()) {}

 private:
  TextureSample at(const Place& place) const override {
    // Grains of about the footprint's size: one sample cannot tell which of them are in it.
    const double grains = place.footprint.size() / grain_;
    const double split = smoothStep(0.35, 0.45, grains) * (1 - smoothStep(5, 8, grains));
    TextureSample sample;
    sample.gloss = static_cast<float>(polish_);
    if (split < 1) sample.color = color(place);
    if (split > 0) {
      Vec3f sum = Vec3f::Zero();
      for (const TexturePoint& part : octants(place.point)) sum += color(Place(part)) / 8;
      sample.color = mix(sample.color, sum, split);
    }
    return sample;
  }

  Vec3f color(const Place& place) const {
    const Footprint inGrains = place.footprint.scaled(1 / grain_);
    const double kept = inGrains.kept(kCellSpread);
    if (kept < 0.01) return mean_;
    return mix(mean_, grains(place, inGrains), kept);
  }

  Vec3f grains(const Place& place, const Footprint& inGrains) const {
    const VaryingPoint p = (1 / grain_) * place.ball;
    // Their walls are bent by noise.
    const Varying bendX = noise(p, inGrains, seed_, 1.4), bendY = noise(p, inGrains, seed_ + 1, 1.4);
    const VaryingPoint bent(p.x + 0.09 * bendX, p.y + 0.09 * bendY, p.z - 0.06 * (bendX + bendY));
    const Cell cell = cellAt(bent, 1, seed_ + 2);
    // Cleavage and clouds within a grain.
    const Varying cloud = fractalNoise(p, inGrains, {2.5, 3, 0.6}, seed_ + 3);
    const auto shares = cell.shares(0.05, place.footprint);
    Vec3f color = Vec3f::Zero();
    for (int i = 0; i < 3; ++i) {
      if (shares[i] > 0) color += static_cast<float>(shares[i]) * mineral(cell.hash[i], cloud.value);
    }

    return withFlakes(place, p, inGrains, color);
  }

  /// Small flakes of mica lie in between, too.
  Vec3f withFlakes(const Place& place, const VaryingPoint& p, const Footprint& inGrains,
                   const Vec3f& grains) const {
    const double frequency = kFlakesShare * micaShare_;
    const double kept = inGrains.kept(kFlakes * kCellSpread);
    Vec3f color = mix(grains, mica_.mean(0.5, 1), (1 - kept) * frequency);
    const Cell flake = cellAt(kFlakes * p, 1, seed_ + 4);
    const auto shares = flake.shares(0.04, place.footprint);
    for (int i = 0; i < 3; ++i) {
      if (shares[i] == 0 || uniform(flake.hash[i], 1) > frequency) continue;
      color += static_cast<float>(kept * shares[i]) * (mica_.mean(uniform(flake.hash[i], 2), 0) - grains);
    }
    return color.cwiseMax(0.0f);
  }

  Vec3f mineral(std::uint32_t hash, double cloud) const {
    const double kind = uniform(hash, 1);
    const double tone = std::clamp(0.1 + 0.8 * uniform(hash, 2) + 0.16 * cloud, 0.0, 1.0);
    if (kind < micaShare_) return mica_.mean(tone, 0);
    if (kind < micaShare_ + (1 - micaShare_) * quartzShare_) return quartz_.mean(tone, 0);
    return (uniform(hash, 3) < pink_ ? pinkFeldspar_ : feldspar_).mean(tone, 0);
  }

  /// Measured: whatever the parameters, the mean of what is drawn.
  Vec3f measuredMean() const {
    constexpr int kCount = 4096;
    const Footprint point(Mat3::Zero());
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = 0; i < kCount; ++i) {
      const Vec3 p = 40 * grain_ * Vec3(uniform(i, 1), uniform(i, 2), uniform(i, 3));
      sum += grains(Place({p, Mat3::Zero()}), point).cast<double>();
    }
    return (sum / kCount).cast<float>();
  }

  double grain_, quartzShare_, micaShare_, pink_, polish_;
  std::uint32_t seed_;
  Ramp feldspar_, pinkFeldspar_, quartz_, mica_;
  Vec3f mean_;
};

}  // namespace

ProceduralTexture granite() {
  return {{"granite",
           "granite: grains of feldspar, quartz and mica",
           {{"grain", 0.06, 0.01, 0.5, "size of the grains"},
            {"quartz", 0.38, 0, 1, "share of quartz in what is not mica"},
            {"mica", 0.12, 0, 1, "share of black mica"},
            {"pink", 0.35, 0, 1, "share of pink in the feldspar"},
            {"polish", 0.7, 0, 1, "gloss of the surface"},
            kSeedParameter}},
          makeOf<Granite>};
}

}  // namespace polestar::detail
