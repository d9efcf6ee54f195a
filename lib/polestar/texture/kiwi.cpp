// Kiwi fruit: a pale core along the axis, rays between locules of seeds, green flesh, brown fuzzy skin.

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

const Vec3f kSeedShell = linearFromSrgb(0x17100b), kSeedShine = linearFromSrgb(0x4b3320);
/// Of the line that the flesh fans out from.
constexpr double kAxisHalfLength = 0.5;
constexpr double kCoreHalfLength = 0.66;

/// Seeds lie two deep in a locule.
SeedLayout seedLayout(const Parameters& p, double fromCore, std::uint32_t salt) {
  SeedLayout layout;
  layout.equator = p["core"] + fromCore;
  layout.pole = kCoreHalfLength + 0.5 * fromCore - 0.08;
  layout.around = p.count("locules");
  layout.rows = 27;
  layout.length = 0.115 * p["seed-size"];
  layout.width = 0.056 * p["seed-size"];
  layout.thickness = 0.05 * p["seed-size"];
  layout.scatter = 0.022;
  layout.presence = p["seeds"];
  layout.seed = p.seed() + salt;
  return layout;
}

class Kiwi final : public FiberTexture {
 public:
  explicit Kiwi(const Parameters& p)
      : locules_(p.count("locules")),
        core_(p["core"]),
        rays_(p["rays"]),
        skin_(p["skin"]),
        fuzz_(p["fuzz"]),
        seed_(p.seed()),
        inner_(seedLayout(p, 0.13, 10)),
        outer_(seedLayout(p, 0.262, 20)),
        locule_({{0, 0xa9ba52},
                 {0.07, 0x6b951d},
                 {0.2, 0x578414},
                 {0.42, 0x6c9a1c},
                 {0.6, 0x83ad2b},
                 {0.88, 0x9fc146},
                 {0.95, 0x8db138},
                 {1, 0xa9bf5c}}),
        ray_({{0, 0xdfe0a2},
              {0.1, 0xbccb68},
              {0.3, 0x9aba40},
              {0.6, 0x92b737},
              {0.88, 0xa4c54b},
              {0.95, 0x90b43a},
              {1, 0xa9bf5c}}),
        corePith_({{0, 0xf3efcf}, {0.6, 0xebe8bd}, {1, 0xdde0a4}}),
        skinColor_({{-2.6, 0x55401f}, {-0.8, 0x765a30}, {0.4, 0x8d6f41}, {2.4, 0xb39868}}) {}

 private:
  TextureSample at(const Place& place) const override {
    TextureSample sample;
    const double skinned = shareAbove(place.radius - (1 - skin_), 0.3 * skin_, place.footprint);
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
    const Fan fan(p, kAxisHalfLength);
    const Varying mottle = fractalNoise(p, footprint, {7.0, 3, 0.55}, seed_);
    const Varying streaks = fanStreaks(fan, footprint, {0.014, 14}, seed_ + 1);

    // 1 at the surface of the core, growing outwards; rays reach into the flesh.
    const Varying across = hypot(p.x, p.y);
    const Varying angle = double(locules_) * atan2(p.y, p.x) + 0.5 * mottle;
    const double ray = 0.5 - 0.5 * meanCosine(angle, footprint);
    const Varying level = hypot(across / core_, p.z / kCoreHalfLength) + 0.05 * mottle;
    const Varying outOfCore = level - 1.0;
    const Varying depth =
        outOfCore * core_ / (max(outOfCore * core_, 0.0) + max(1.0 - skin_ - place.radius, 0.0));

    // Pale rays between the locules, dark in the seeds' zone and lost towards the skin.
    const double contrast = rays_ * std::clamp(0.05 + 0.95 * ray * ray + 0.14 * streaks.value, 0.0, 1.0);
    Vec3f color = mix(locule_.mean(depth, footprint), ray_.mean(depth, footprint), contrast);
    color *= static_cast<float>(1 + 0.07 * streaks.value + 0.03 * mottle.value);

    TextureSample sample;
    sample.gloss = 0.35f;
    addSeed(place, inner_, sample, color);
    addSeed(place, outer_, sample, color);
    const double inCore = shareAbove(-1.0 * outOfCore + 0.1 * (ray - 0.5), 0.22, footprint);
    color =
        mix(color, corePith_.mean(level, footprint) * static_cast<float>(1 + 0.03 * mottle.value), inCore);
    sample.color = color;
    return sample;
  }

  /// Near-black, a brown shine on the side; around it the locule's clear, dark jelly.
  void addSeed(const Place& place, const SeedLayout& layout, TextureSample& sample, Vec3f& color) const {
    const Seed seed = seedNear(place.ball, place.footprint, layout);
    const double jelly = seed.share(1.55, 2.2, place.footprint);
    color = mix(color, color.cwiseProduct(Vec3f(0.55f, 0.66f, 0.4f)), 0.8 * jelly);
    const double inside = seed.share(1, 0.25, place.footprint);
    const double shine = std::exp(-6 * std::pow(seed.across + 0.35, 2)) * (0.3 + 0.7 * uniform(seed.hash, 7));
    const Vec3f shell = mix(kSeedShell, kSeedShine, 0.7 * shine);
    color = mix(color, shell, inside);
    sample.gloss = static_cast<float>(mix(sample.gloss, 0.8, inside));
  }

  /// Short hairs that lie along the meridians, a little curled, over a rough brown skin.
  TextureSample skin(const Place& place) const {
    const VaryingPoint& p = place.ball;
    const Varying curl = noise(p, place.footprint, seed_ + 5, 3.0);
    const VaryingPoint hairs(70.0 * p.x + 1.5 * curl, 70.0 * p.y - 1.5 * curl, 16.0 * p.z);
    const Varying hair = fractalNoise(hairs, place.footprint.in(hairs), {1, 2, 0.8}, seed_ + 6);
    const Varying rough = fractalNoise(p, place.footprint, {5.0, 5, 0.7}, seed_ + 7);
    const Varying tone = 0.9 * rough + 0.7 * fuzz_ * hair;
    TextureSample sample;
    sample.color = skinColor_.mean(tone, place.footprint);
    sample.gloss = 0.05f;
    sample.heightGradient = 0.0016 * (rough.gradient + fuzz_ * hair.gradient);
    return sample;
  }

  int locules_;
  double core_, rays_, skin_, fuzz_;
  std::uint32_t seed_;
  SeedLayout inner_, outer_;
  Ramp locule_, ray_, corePith_, skinColor_;
};

}  // namespace

ProceduralTexture kiwi() {
  return {{"kiwi",
           "kiwi fruit: pale core, seeds in locules, green flesh, brown fuzzy skin",
           {{"locules", 30, 8, 80, "chambers around the core, a row of seeds in each"},
            {"seeds", 0.72, 0, 1, "share of the places for seeds that hold one"},
            {"seed-size", 1, 0.3, 1.5, "of a seed, over that of the real fruit"},
            {"core", 0.17, 0.05, 0.4, "radius of the pale core at the equator"},
            {"rays", 0.8, 0, 1, "contrast of the pale rays between the locules"},
            {"skin", 0.016, 0, 0.1, "thickness of the skin"},
            {"fuzz", 0.8, 0, 2, "hairiness of the skin"},
            kSeedParameter}},
          makeOf<Kiwi>};
}

}  // namespace polestar::detail
