// Agate: bands of chalcedony that follow the wall of a cavity inwards, quartz crystals in its middle, a rough
// crust outside.

#include "polestar/io/picture.h"
#include "polestar/texture/detail/cells.h"
#include "polestar/texture/detail/hash.h"
#include "polestar/texture/detail/noise.h"
#include "polestar/texture/detail/point_texture.h"
#include "polestar/texture/detail/procedural_texture.h"
#include "polestar/texture/detail/ramp.h"

namespace polestar::detail {
namespace {

const Vec3f kCrystalEdge = linearFromSrgb(0xfaf8fb);
/// A random function of depth: broad tones and fine lines, in colors that change from gray-blue to red-brown
/// and back. As a ramp, so that its mean over any interval of depth is exact. `aside` is the way to a
/// sequence that is alike but not the same.
Ramp bandsOf(const Parameters& p, double aside) {
  const Ramp cool({{-2.4, 0x3f4a57},
                   {-1.4, 0x6b7f8f},
                   {-0.7, 0x9aabb4},
                   {-0.25, 0xd5d9d8},
                   {0.05, 0xf3f0ea},
                   {0.5, 0xbcc3c4},
                   {1.1, 0x83939d},
                   {2.2, 0xe3e0d8}});
  const Ramp ember({{-2.4, 0x571f10},
                    {-1.4, 0x8b3a1a},
                    {-0.7, 0xb9652f},
                    {-0.25, 0xe4c59a},
                    {0.05, 0xf6ecd9},
                    {0.5, 0xdba35f},
                    {1.1, 0xa34e28},
                    {2.2, 0xe9d3b0}});
  constexpr double kStart = -0.2, kStep = 1.0 / 2048;
  const Footprint blur(kStep * Mat3::Identity());
  std::vector<Ramp::Stop> stops;
  for (double depth = kStart; depth < 1.2; depth += kStep) {
    const VaryingPoint broad = 0.4 * p["bands"] * VaryingPoint(Vec3(depth, 0, 0));
    const VaryingPoint offset(broad.x, broad.y + aside, broad.z);
    const Varying tone = fractalNoise(offset, blur.in(offset), {1, 5, 0.72}, p.seed() + 1);
    const Varying hue = noise(broad, blur.in(broad), p.seed() + 2, 0.33);
    const double warmth = std::clamp(p["warm"] + 0.6 * hue.value, 0.0, 1.0);
    stops.push_back({depth, mix(cool.mean(1.2 * tone, blur), ember.mean(1.2 * tone, blur), warmth)});
  }
  return Ramp(std::move(stops));
}

class Agate final : public PointTexture {
 public:
  explicit Agate(const Parameters& p)
      : warp_(p["warp"]),
        crystal_(p["crystal"]),
        amethyst_(p["amethyst"]),
        crust_(p["crust"]),
        seed_(p.seed()),
        first_(bandsOf(p, 0)),
        second_(bandsOf(p, 0.16)),
        quartz_({{0, 0xb7b6b8}, {0.5, 0xdad9da}, {1, 0xf7f6f4}}),
        violet_({{0, 0x4a2a6b}, {0.5, 0x8a63ad}, {1, 0xcdb5dd}}),
        crustColor_({{-2, 0x3f352c}, {0, 0x6d5d4d}, {2, 0x9a8a76}}) {}

 private:
  TextureSample at(const Place& place) const override {
    const Footprint& footprint = place.footprint;
    const VaryingPoint& p = place.ball;
    // The bands begin as the crust's even wall and get their bulges on the way in.
    const Varying bulge = fractalNoise(p, footprint, {1.7, 3, 0.36}, seed_);
    const Varying depth =
        1.0 - crust_ - place.radius + 0.075 * warp_ * bulge * (1.0 - place.radius * place.radius);

    TextureSample sample;
    sample.color = chalcedony(place, depth, bulge);
    sample.gloss = 0.75f;
    const double hollow = 1 - crust_ - crystal_;
    const double inside = shareAbove(depth - hollow + crystalRoots(place), 0.012, footprint);
    if (inside > 0) sample.color = mix(sample.color, crystals(place, depth - hollow), inside);
    const double crusted = shareAbove(-1.0 * depth, 0.01, footprint);
    if (crusted > 0) {
      const Varying rough = fractalNoise(p, footprint, {9.0, 5, 0.6}, seed_ + 9);
      sample.color = mix(sample.color, crustColor_.mean(rough, footprint), crusted);
      sample.gloss *= static_cast<float>(1 - crusted);
      sample.heightGradient = 0.012 * crusted * rough.gradient;
    }
    return sample;
  }

  /// Along the wall the bands come and go: two sequences, blended by the bulges.
  Vec3f chalcedony(const Place& place, const Varying& depth, const Varying& bulge) const {
    const double blend = std::clamp(0.5 + 0.45 * bulge.value, 0.0, 1.0);
    return mix(first_.mean(depth, place.footprint), second_.mean(depth, place.footprint), blend);
  }

  /// Points of crystals reach into the bands, ball radii.
  Varying crystalRoots(const Place& place) const {
    const VaryingPoint domain = 11.0 * place.ball;
    return -0.03 * cellAt(domain, 1, seed_ + 3).center;
  }

  /// Uniform in [0, 1], one for each cell.
  static double toneOf(const Cell& cell, const Footprint& footprint) {
    const auto shares = cell.shares(0.02, footprint);
    double tone = 0;
    for (int i = 0; i < 3; ++i) tone += shares[i] * uniform(cell.hash[i], 1);
    return tone;
  }

  /// Prisms that grew inwards: facets of one tone each, darker in the depth of the hollow.
  Vec3f crystals(const Place& place, const Varying& depth) const {
    const VaryingPoint domain = 11.0 * place.ball;
    const Footprint inDomain = place.footprint.in(domain);
    const Cell cell = cellAt(domain, 1, seed_ + 3);
    const Cell facet = cellAt(2.3 * domain, 1, seed_ + 4);
    const double kept = inDomain.kept(kCellSpread), keptFine = inDomain.kept(2.3 * kCellSpread);
    const double coarse = toneOf(cell, place.footprint), fine = toneOf(facet, place.footprint);
    const double light = 0.5 + kept * 0.6 * (coarse - 0.5) + keptFine * 0.45 * (fine - 0.5);
    const double violet = amethyst_ * smoothStep(0, 0.7 * crystal_, depth.value);
    constexpr double kWidth = 0.05;
    Vec3f color = mix(quartz_.mean(light, kWidth), violet_.mean(light, kWidth), violet);
    const double edge = shareWithin(cell.walls[0], 0.02, 0.05, place.footprint);
    return mix(color, kCrystalEdge, 0.35 * kept * edge);
  }

  double warp_, crystal_, amethyst_, crust_;
  std::uint32_t seed_;
  Ramp first_, second_, quartz_, violet_, crustColor_;
};

}  // namespace

ProceduralTexture agate() {
  return {{"agate",
           "agate: chalcedony bands around a hollow of quartz crystals",
           {{"bands", 26, 4, 200, "bands along a radius, about"},
            {"warp", 1, 0, 3, "unevenness of the bands"},
            {"crystal", 0.3, 0, 0.8, "radius of the hollow with crystals"},
            {"amethyst", 0.7, 0, 1, "violet of the crystals"},
            {"warm", 0.4, 0, 1, "from blue-gray bands to red-brown ones"},
            {"crust", 0.03, 0, 0.2, "thickness of the rough crust"},
            kSeedParameter}},
          makeOf<Agate>};
}

}  // namespace polestar::detail
