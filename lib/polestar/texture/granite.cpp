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
        mica_({{0, 0x1a1a1c}, {0.7, 0x303032}, {1, 0x65625d}}) {}

 private:
  TextureSample at(const Place& place) const override {
    const Footprint& footprint = place.footprint;
    const VaryingPoint p = (1 / grain_) * place.ball;
    const Footprint inGrains = footprint.in(p);
    // Grains are not convex: their walls are bent by noise.
    const Varying bendX = noise(p, inGrains, seed_, 1.4), bendY = noise(p, inGrains, seed_ + 1, 1.4);
    const VaryingPoint bent(p.x + 0.09 * bendX, p.y + 0.09 * bendY, p.z - 0.06 * (bendX + bendY));
    const Cell cell = cellAt(bent, 1, seed_ + 2);
    const double own = shareAbove(cell.wall, 0.05, footprint);
    // Cleavage and clouds within a grain.
    const Varying cloud = fractalNoise(p, inGrains, {2.5, 3, 0.6}, seed_ + 3);
    TextureSample sample;
    sample.color = mix(mineral(cell.neighbour, cloud.value), mineral(cell.hash, cloud.value), own);
    addFlakes(place, p, inGrains, sample);

    const double kept = inGrains.kept(kCellSpread);
    sample.color = mix(meanColor(), sample.color, kept);
    sample.gloss = static_cast<float>(polish_);
    return sample;
  }

  Vec3f mineral(std::uint32_t hash, double cloud) const {
    const double kind = uniform(hash, 1);
    const double tone = std::clamp(0.1 + 0.8 * uniform(hash, 2) + 0.16 * cloud, 0.0, 1.0);
    if (kind < micaShare_) return mica_.mean(tone, 0);
    if (kind < micaShare_ + (1 - micaShare_) * quartzShare_) return quartz_.mean(tone, 0);
    return (uniform(hash, 3) < pink_ ? pinkFeldspar_ : feldspar_).mean(tone, 0);
  }

  /// Small flakes of mica lie in between, too.
  void addFlakes(const Place& place, const VaryingPoint& p, const Footprint& inGrains,
                 TextureSample& sample) const {
    const VaryingPoint fine = 2.6 * p;
    const Cell flake = cellAt(fine, 1, seed_ + 4);
    if (uniform(flake.hash, 1) > 0.7 * micaShare_) return;
    const double kept = inGrains.scaled(2.6).kept(kCellSpread);
    const double inside = shareAbove(flake.wall - 0.05, 0.04, place.footprint);
    sample.color = mix(sample.color, mica_.mean(uniform(flake.hash, 2), 0), kept * inside);
  }

  Vec3f meanColor() const {
    const double quartz = (1 - micaShare_) * quartzShare_, feldspar = 1 - micaShare_ - quartz;
    return static_cast<float>(micaShare_) * mica_.mean(0.5, 0.6) +
           static_cast<float>(quartz) * quartz_.mean(0.5, 0.6) +
           static_cast<float>(feldspar * pink_) * pinkFeldspar_.mean(0.5, 0.6) +
           static_cast<float>(feldspar * (1 - pink_)) * feldspar_.mean(0.5, 0.6);
  }

  double grain_, quartzShare_, micaShare_, pink_, polish_;
  std::uint32_t seed_;
  Ramp feldspar_, pinkFeldspar_, quartz_, mica_;
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
