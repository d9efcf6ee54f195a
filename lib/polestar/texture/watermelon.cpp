// Watermelon: red flesh with a paler, three-lobed heart, rings of flat seeds, a rind from white to green,
// dark jagged stripes along the meridians.

#include "polestar/io/picture.h"
#include "polestar/texture/detail/fan.h"
#include "polestar/texture/detail/hash.h"
#include "polestar/texture/detail/noise.h"
#include "polestar/texture/detail/point_texture.h"
#include "polestar/texture/detail/procedural_texture.h"
#include "polestar/texture/detail/ramp.h"
#include "polestar/texture/detail/seeds.h"

namespace polestar::detail {
namespace {

const Vec3f kSparkle = linearFromSrgb(0xf6a7a0), kHollow = linearFromSrgb(0xc4222e),
            kBlackSeed = linearFromSrgb(0x1a1110), kBrownSeed = linearFromSrgb(0x4a2b1b),
            kSeedRim = linearFromSrgb(0x6f4a2c), kVein = linearFromSrgb(0x4f7a38),
            kScar = linearFromSrgb(0x8a7a4e);
constexpr double kAxisHalfLength = 0.25;

SeedLayout seedLayout(const Parameters& p, double equator, int around, std::uint32_t salt) {
  SeedLayout layout;
  const double flesh = 1 - p["rind"];
  layout.equator = equator * flesh;
  layout.pole = (0.15 + 0.85 * equator) * flesh;
  layout.around = around;
  layout.rows = around * 4 / 5;
  layout.thinning = true;
  layout.length = 0.1 * p["seed-size"];
  layout.width = 0.06 * p["seed-size"];
  layout.thickness = 0.034 * p["seed-size"];
  layout.scatter = 0.05;
  layout.presence = p["seeds"];
  layout.seed = p.seed() + salt;
  return layout;
}

class Watermelon final : public FiberTexture {
 public:
  explicit Watermelon(const Parameters& p)
      : stripes_(p.count("stripes")),
        rind_(p["rind"]),
        jag_(p["jaggedness"]),
        seed_(p.seed()),
        inner_(seedLayout(p, 0.6, 22, 10)),
        outer_(seedLayout(p, 0.78, 26, 20)),
        // From the center to the flesh's edge at 1, on through the rind to the skin at 2.
        layers_({{0, 0xe7666b},
                 {0.3, 0xe4565c},
                 {0.5, 0xdc343f},
                 {0.8, 0xd62b38},
                 {0.93, 0xdf4a50},
                 {1, 0xec8c86},
                 {1.12, 0xf3cdbb},
                 {1.3, 0xf2efd8},
                 {1.6, 0xdfe8bb},
                 {1.85, 0xb3cb7d},
                 {2, 0x6f9845}}),
        pale_({{-2, 0x7fa653}, {-0.3, 0x9cbd68}, {1, 0xb3cd80}, {2, 0xc3d894}}),
        dark_({{-2, 0x12341a}, {0, 0x1f4b22}, {2, 0x37692f}}) {}

 private:
  TextureSample at(const Place& place) const override {
    TextureSample sample;
    constexpr double kSkin = 0.022;
    const double skinned = shareAbove(place.radius - (1 - kSkin), kSkin, place.footprint);
    if (skinned < 1) sample = flesh(place);
    if (skinned > 0) {
      const TextureSample outer = skin(place);
      sample.color = mix(sample.color, outer.color, skinned);
      sample.gloss = static_cast<float>(mix(sample.gloss, outer.gloss, skinned));
      sample.heightGradient = skinned * outer.heightGradient;
    }
    return sample;
  }

  Vec3 fiberAt(const Vec3& ball) const override { return fanDirection(ball, kAxisHalfLength); }

  TextureSample flesh(const Place& place) const {
    const Footprint& footprint = place.footprint;
    const VaryingPoint& p = place.ball;
    const Varying mottle = fractalNoise(p, footprint, {4.0, 2, 0.5}, seed_);
    const Varying grain = fractalNoise(p, footprint, {36.0, 2, 0.7}, seed_ + 1);
    const Fan fan(p, kAxisHalfLength);
    const Varying streaks = fanStreaks(fan, footprint, {0.017, 7}, seed_ + 2);

    // The heart has three lobes; the axis itself has no side.
    const Varying squared = p.x * p.x + p.y * p.y;
    const Varying lobes = squared / (squared + 0.03) * cos(3.0 * atan2(p.y, p.x) + 0.5 * mottle);
    const Varying layer = layerOf(place.radius + 0.006 * mottle) + 0.14 * lobes * (1.0 - place.radius);
    const double inFlesh = shareAbove(1.02 - layer, 0.2, footprint);
    TextureSample sample;
    sample.color = layers_.mean(layer, footprint);
    // Sugar and torn cells catch the light.
    const double fleck = 0.05 * grain.value + 0.06 * streaks.value + 0.04 * mottle.value;
    const double sparkle = smoothStep(1.2, 3.6, grain.value + 0.5 * streaks.value);
    sample.color *= static_cast<float>(1 + inFlesh * fleck + (1 - inFlesh) * 0.02 * grain.value);
    sample.color = mix(sample.color, kSparkle, 0.28 * inFlesh * sparkle);
    sample.gloss = static_cast<float>(0.35 * inFlesh);
    addSeed(place, inner_, sample);
    addSeed(place, outer_, sample);
    return sample;
  }

  Varying layerOf(const Varying& radius) const {
    const double edge = 1 - rind_;
    if (radius.value < edge) return radius / edge;
    return 1.0 + (radius - edge) / rind_;
  }

  void addSeed(const Place& place, const SeedLayout& layout, TextureSample& sample) const {
    const Seed seed = seedNear(place.ball, place.footprint, layout);
    // A seed sits in a small hollow with a pale wall.
    const double hollow = seed.share(1.38, 0.9, place.footprint);
    sample.color = mix(sample.color, kHollow, 0.6 * hollow);
    const double inside = seed.share(1, 0.2, place.footprint);
    const double ripe = uniform(seed.hash, 8);
    const Vec3f shell = mix(kBlackSeed, kBrownSeed, ripe * ripe);
    const double rim = smoothStep(0.45, 1, seed.form.value) + smoothStep(-0.4, -0.9, seed.along);
    sample.color = mix(sample.color, mix(shell, kSeedRim, 0.35 * std::min(rim, 1.0)), inside);
    sample.gloss = static_cast<float>(mix(sample.gloss, 0.7, inside));
  }

  TextureSample skin(const Place& place) const {
    const Footprint& footprint = place.footprint;
    const VaryingPoint& p = place.ball;
    const Varying bend = noise(p, footprint, seed_ + 4, 2.2);
    // Edges are torn across the stripes: noise that is drawn out around the axis.
    const VaryingPoint across(9.0 * p.x, 9.0 * p.y, 22.0 * p.z);
    const Varying torn = fractalNoise(across, footprint.in(across), {1, 4, 0.62}, seed_ + 5);
    const Varying angle = double(stripes_) * atan2(p.y, p.x) + 0.7 * bend;
    const Varying stripe = cos(angle) + jag_ * (0.55 * torn + 0.25 * bend) - 0.1;
    const double covered = shareAbove(stripe, 0.35, footprint);

    // Between the stripes a net of fine dark veins.
    const VaryingPoint fine = 16.0 * p;
    const Varying net = fractalNoise(fine, footprint.in(fine), {1, 3, 0.6}, seed_ + 6);
    const double vein = shareWithin(net, 0.16, 0.25, footprint);
    const Vec3f pale = mix(pale_.mean(0.6 * torn + 0.5 * bend, footprint), kVein, 0.55 * vein);
    TextureSample sample;
    sample.color = mix(pale, dark_.mean(0.8 * net, footprint), covered);
    sample.gloss = 0.5f;
    sample.heightGradient = 0.0003 * torn.gradient;
    addScars(place, sample);
    return sample;
  }

  /// The stem's at the upper pole, the blossom's at the lower.
  void addScars(const Place& place, TextureSample& sample) const {
    const double radius = place.ball.z.value > 0 ? 0.07 : 0.035;
    const Varying across = hypot(place.ball.x, place.ball.y);
    const double scar = shareAbove(radius - across, 0.05, place.footprint);
    sample.color = mix(sample.color, kScar, scar);
    sample.gloss *= static_cast<float>(1 - scar);
    sample.heightGradient += 0.25 * scar * across.gradient;
  }

  int stripes_;
  double rind_, jag_;
  std::uint32_t seed_;
  SeedLayout inner_, outer_;
  Ramp layers_, pale_, dark_;
};

}  // namespace

ProceduralTexture watermelon() {
  return {{"watermelon",
           "watermelon: red flesh, rings of seeds, white to green rind, dark jagged stripes",
           {{"stripes", 11, 3, 40, "dark stripes around the skin"},
            {"jaggedness", 1, 0, 2, "how torn the edges of the stripes are"},
            {"rind", 0.15, 0.05, 0.4, "thickness of the rind"},
            {"seeds", 0.7, 0, 1, "share of the places for seeds that hold one"},
            {"seed-size", 1, 0.3, 1.5, "of a seed, over that of the real fruit"},
            kSeedParameter}},
          makeOf<Watermelon>};
}

}  // namespace polestar::detail
