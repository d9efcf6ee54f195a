// Wood of a trunk along z: growth layers about a pith that lies a little off the axis, pale early wood and
// dark late wood, rays, fibers, bark.

#include <numbers>

#include "polestar/io/picture.h"
#include "polestar/texture/detail/cells.h"
#include "polestar/texture/detail/noise.h"
#include "polestar/texture/detail/point_texture.h"
#include "polestar/texture/detail/procedural_texture.h"
#include "polestar/texture/detail/ramp.h"

namespace polestar::detail {
namespace {

const Vec3f kPore = linearFromSrgb(0x5d3a1f), kPith = linearFromSrgb(0x5a3719),
            kRay = linearFromSrgb(0xe9cfa2);
/// Where the pith crosses the equator.
constexpr double kPithX = 0.09, kPithY = -0.06;
/// A trunk's layers are cones: what lies higher is younger.
constexpr double kTaper = 0.22;

class TreeRings final : public FiberTexture {
 public:
  explicit TreeRings(const Parameters& p)
      : rings_(p["rings"]),
        wobble_(p["wobble"]),
        lateWood_(p["latewood"]),
        rays_(p["rays"]),
        grain_(p["grain"]),
        spiral_(p["spiral"]),
        bark_(p["bark"]),
        yearsDarkness_(darknessOfYear(1)),
        seed_(p.seed()),
        // By age: heartwood, sapwood under the bark.
        early_({{0, 0xc79660}, {0.5, 0xd0a06a}, {0.72, 0xd8ad78}, {0.8, 0xe6c697}, {1, 0xead0a4}}),
        late_({{0, 0x7a4a26}, {0.5, 0x86552e}, {0.72, 0x94623a}, {0.8, 0xb98a58}, {1, 0xc1946a}}),
        barkColor_({{-2.2, 0x2a1f17}, {-0.9, 0x47372a}, {0.2, 0x6d5846}, {1.2, 0x8d7763}, {2.4, 0xad9c8a}}) {}

 private:
  /// The trunk's own coordinates: about the pith, turned back by the spiral of the grain.
  struct Trunk {
    VaryingPoint p;
    Varying age;  ///< 0 at the pith, about 1 at the bark of the equator
  };

  TextureSample at(const Place& place) const override {
    TextureSample sample;
    const double barked =
        bark_ > 0 ? shareAbove(place.radius - (1 - bark_), 0.1 * bark_, place.footprint) : 0;
    if (barked < 1) sample = wood(place);
    if (barked > 0) {
      const TextureSample outer = bark(place);
      sample.color = mix(sample.color, outer.color, barked);
      sample.gloss = static_cast<float>(mix(sample.gloss, outer.gloss, barked));
      sample.heightGradient = barked * outer.heightGradient;
    }
    return sample;
  }

  Trunk trunkAt(const Place& place) const {
    const VaryingPoint& b = place.ball;
    const Varying x = b.x - kPithX, y = b.y - kPithY;
    const Varying turn = spiral_ * b.z, c = cos(turn), s = sin(turn);
    Trunk trunk{{c * x + s * y, c * y - s * x, b.z}, {}};
    const VaryingPoint slow(1.4 * trunk.p.x, 1.4 * trunk.p.y, 0.45 * trunk.p.z);
    const Varying bend = fractalNoise(slow, place.footprint.in(slow), {1, 3, 0.2}, seed_);
    const Varying across = hypot(trunk.p.x, trunk.p.y);
    trunk.age = across * (1.0 + kTaper * b.z * b.z) * (1.0 + 0.036 * wobble_ * bend);
    return trunk;
  }

  /// Tangent to the layers, turned by the spiral: d/dz at constant trunk coordinates and age.
  Vec3 fiberAt(const Vec3& ball) const override {
    const double x = ball[0] - kPithX, y = ball[1] - kPithY;
    const double inwards = -2 * kTaper * ball[2] / (1 + kTaper * ball[2] * ball[2]);
    return {inwards * x - spiral_ * y, inwards * y + spiral_ * x, 1};
  }

  TextureSample wood(const Place& place) const {
    const Footprint& footprint = place.footprint;
    const Trunk trunk = trunkAt(place);
    const double late = lateShare(trunk.age, footprint);
    TextureSample sample;
    sample.color = mix(early_.mean(trunk.age, footprint), late_.mean(trunk.age, footprint), late);

    // Vessels and fibers: drawn out along the grain. The domain is the trunk's, so they follow its spiral.
    const double inward = 1 + kTaper * trunk.p.z.value * trunk.p.z.value;
    const VaryingPoint along(inward * trunk.p.x, inward * trunk.p.y, trunk.p.z / 26.0);
    const VaryingPoint coarse = 55.0 * along, fine = 150.0 * along;
    const Varying fibers = noise(coarse, footprint.in(coarse), seed_ + 1);
    const Varying vessels = noise(fine, footprint.in(fine), seed_ + 2);
    const double pores = shareAbove(vessels - (1.15 + 0.8 * late), 0.5, footprint);
    sample.color *= static_cast<float>(1 + grain_ * (0.07 * fibers.value + 0.04 * vessels.value));
    sample.color = mix(sample.color, kPore, 0.5 * grain_ * pores);
    addRays(place, trunk, sample);
    const double pith = shareAbove(0.022 - trunk.age, 0.012, footprint);
    sample.color = mix(sample.color, kPith, 0.8 * pith);
    sample.gloss = 0.1f;
    return sample;
  }

  /// Years are unequal: age is warped by slow noise of itself.
  double lateShare(const Varying& age, const Footprint& footprint) const {
    const VaryingPoint line(5.0 * age, 0.0, 0.0);
    const Varying years = rings_ * (age + 0.035 * noise(line, footprint.in(line), seed_ + 3));
    // Within a year: slowly darker, at the winter's line at once pale.
    const double width = footprint.width(years), start = years.value - width / 2;
    if (width < 1e-6) return darkness(years.value - std::floor(years.value));
    return (darknessUpTo(start + width) - darknessUpTo(start)) / width;
  }

  /// Of a year's wood at the share `t` of its growth.
  double darkness(double t) const { return std::pow(t, latePower()) * std::min(1.0, (1 - t) / kWinter); }
  double latePower() const { return 1 / lateWood_; }

  /// Integral of the darkness from year 0: the mean over any span of years is exact.
  double darknessUpTo(double years) const {
    const double whole = std::floor(years);
    return whole * yearsDarkness_ + darknessOfYear(years - whole);
  }

  double darknessOfYear(double t) const {
    const double n = latePower(), edge = 1 - kWinter;
    const double rising = std::pow(std::min(t, edge), n + 1) / (n + 1);
    if (t <= edge) return rising;
    auto falling = [&](double s) { return std::pow(s, n + 1) * (1 / (n + 1) - s / (n + 2)) / kWinter; };
    return rising + falling(t) - falling(edge);
  }

  /// Thin plates of cells from the pith outwards, a few rings long, spindles along the grain.
  void addRays(const Place& place, const Trunk& trunk, TextureSample& sample) const {
    const Varying across = hypot(trunk.p.x, trunk.p.y);
    // A ring of lattice, in which a ray is narrow around the axis, long outwards and of some height.
    const Varying ring = 34.0 + 2.5 * across;
    VaryingPoint domain(ring * trunk.p.x / across, ring * trunk.p.y / across, 24.0 * trunk.p.z);
    const Footprint inDomain = place.footprint.in(domain);
    const Varying n = noise(domain, inDomain, seed_ + 4);
    const double ray = shareAbove(n - 1.5, 0.8, place.footprint);
    sample.color = mix(sample.color, kRay, 0.42 * rays_ * ray);
  }

  /// Plates between fissures that run along the trunk.
  TextureSample bark(const Place& place) const {
    const Footprint& footprint = place.footprint;
    const VaryingPoint& p = place.ball;
    const Varying bend = noise(p, footprint, seed_ + 5, 3.0);
    const VaryingPoint plates(9.0 * p.x + 0.16 * bend, 9.0 * p.y - 0.16 * bend, 3.0 * p.z + 0.1 * bend);
    const Cell plate = cellAt(plates, 1, seed_ + 6);
    const double kept = footprint.in(plates).kept(kCellSpread);
    const VaryingPoint fibers(26.0 * p.x, 26.0 * p.y, 9.0 * p.z);
    const Varying rough = fractalNoise(fibers, footprint.in(fibers), {1, 4, 0.65}, seed_ + 7);
    // Height over the fissures, 0 to 1.
    const double slope = 5, height = 1 - std::exp(-slope * plate.walls[0].value);
    TextureSample sample;
    const Varying tone(mix(0.2, 2.6 * height - 1.5, kept) + 0.55 * rough.value, 0.55 * rough.gradient,
                       0.3 * rough.variance + 0.4 * (1 - kept));
    sample.color = barkColor_.mean(tone, footprint);
    sample.heightGradient =
        0.028 * kept * slope * (1 - height) * plate.walls[0].gradient + 0.004 * rough.gradient;
    return sample;
  }

  /// Share of a year in which growth stops.
  static constexpr double kWinter = 0.08;

  double rings_, wobble_, lateWood_, rays_, grain_, spiral_, bark_, yearsDarkness_;
  std::uint32_t seed_;
  Ramp early_, late_, barkColor_;
};

}  // namespace

ProceduralTexture treeRings() {
  return {{"tree-rings",
           "a trunk: growth rings about the z axis, early and late wood, rays, fibers, bark",
           {{"rings", 24, 3, 200, "years from the pith to the bark"},
            {"wobble", 1, 0, 3, "unevenness of the rings"},
            {"latewood", 0.4, 0.05, 1, "share of the dark late wood in a year's"},
            {"rays", 1, 0, 2, "contrast of the pith rays"},
            {"grain", 1, 0, 3, "contrast of fibers and vessels"},
            {"spiral", 0.25, -2, 2, "turn of the grain around the trunk, radians per ball radius"},
            {"bark", 0.06, 0, 0.3, "thickness of the bark"},
            kSeedParameter}},
          makeOf<TreeRings>};
}

}  // namespace polestar::detail
