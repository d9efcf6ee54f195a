// Orange: segments about the axis between white membranes, filled with drawn-out juice vesicles; white pith,
// dimpled zest.

#include <numbers>

#include "polestar/io/picture.h"
#include "polestar/texture/detail/cells.h"
#include "polestar/texture/detail/fan.h"
#include "polestar/texture/detail/hash.h"
#include "polestar/texture/detail/noise.h"
#include "polestar/texture/detail/point_texture.h"
#include "polestar/texture/detail/procedural_texture.h"
#include "polestar/texture/detail/ramp.h"

namespace polestar::detail {
namespace {

const Vec3f kThinMembrane = linearFromSrgb(0xf6d08c), kGland = linearFromSrgb(0xd9820f),
            kVesicleWall = linearFromSrgb(0xffd488), kSegmentSkin = linearFromSrgb(0xfbd594),
            kStem = linearFromSrgb(0x7d8a3f);
constexpr double kAxisHalfLength = 0.4;
/// Oil glands per ball radius.
constexpr double kGlands = 26;

/// The smaller of two distances, their corner rounded over `radius`.
Varying roundedMin(const Varying& a, const Varying& b, double radius) {
  const Varying overlap = max(radius - abs(a - b), 0.0);
  return min(a, b) - overlap * overlap / (4 * radius);
}

class Orange final : public FiberTexture {
 public:
  explicit Orange(const Parameters& p)
      : segments_(p.count("segments")),
        membrane_(p["membrane"]),
        core_(p["core"]),
        zest_(p["zest"]),
        pith_(p["pith"]),
        vesicle_(p["vesicle"]),
        dimples_(p["dimples"]),
        seed_(p.seed()),
        juice_({{0, 0xef8408}, {0.3, 0xf6960f}, {0.6, 0xfba51e}, {0.85, 0xfeb636}, {1, 0xffcb62}}),
        white_({{-2, 0xeadcb8}, {0, 0xf5ebd2}, {2, 0xfaf5e6}}),
        // Through the zest, from the pith at 0 to the skin at 1.
        peel_({{0, 0xf3cf8c}, {0.25, 0xf2b04c}, {0.6, 0xee8f1c}, {1, 0xe87a0e}}),
        skinColor_({{-3, 0xe0700c}, {0, 0xee8617}, {3, 0xf5992a}}) {}

 private:
  TextureSample at(const Place& place) const override {
    const double skinned = shareAbove(place.radius - (1 - 0.3 * zest_), 0.3 * zest_, place.footprint);
    TextureSample sample;
    if (skinned < 1) sample = inside(place);
    if (skinned > 0) {
      const TextureSample outer = skin(place);
      sample.color = mix(sample.color, outer.color, skinned);
      sample.gloss = static_cast<float>(mix(sample.gloss, outer.gloss, skinned));
      sample.heightGradient = skinned * outer.heightGradient;
    }
    return sample;
  }

  Vec3 fiberAt(const Vec3& ball) const override { return fanDirection(ball, kAxisHalfLength); }

  struct Segment {
    int index;
    Varying depth;  ///< from its wall inwards, ball radii
  };

  Segment segmentAt(const Place& place, const Varying& wobble) const {
    const VaryingPoint& p = place.ball;
    const Varying across = hypot(p.x, p.y);
    // Segments of unequal widths: the angle is warped by a function of direction alone.
    const VaryingPoint around = 1.1 * VaryingPoint(p.x / across, p.y / across, 0.0);
    const Varying warp = noise(around, place.footprint.in(around), seed_);
    const double perTurn = segments_ / (2 * std::numbers::pi);
    const Varying turn = perTurn * (atan2(p.y, p.x) + 0.08 * warp + 0.012 * wobble) + 0.5;
    const double wall = std::round(turn.value);
    const int index = static_cast<int>(std::floor(turn.value)) % segments_;
    const Varying fromWall = abs((turn - wall) / perTurn) * across - membrane_ / 2;
    const Varying fromPith = 1 - zest_ - pith_ - place.radius + 0.005 * wobble;
    const Varying fromCore = across - core_ * (1.0 + 0.25 * wobble);
    const Varying corner = roundedMin(fromWall, fromPith, 0.09);
    return {(index + segments_) % segments_, roundedMin(corner, fromCore, 0.03)};
  }

  TextureSample inside(const Place& place) const {
    const Footprint& footprint = place.footprint;
    const VaryingPoint& p = place.ball;
    const Varying wobble = noise(p, footprint, seed_ + 1, 4.0);
    const Segment segment = segmentAt(place, wobble);
    const double pulp = shareAbove(segment.depth, 0.004, footprint);

    TextureSample sample;
    if (pulp < 1) {
      const Varying fibers = fractalNoise(p, footprint, {11.0, 4, 0.65}, seed_ + 2);
      sample.color = white_.mean(fibers, footprint);
      // Towards the center the walls are thin enough to shine through.
      const double thin = smoothStep(0.9 - zest_ - pith_, 0.5, place.radius.value);
      sample.color = mix(sample.color, kThinMembrane, 0.5 * thin);
      const Varying peel = (place.radius - (1 - zest_)) / zest_ + 0.12 * fibers;
      sample.color = mix(sample.color, peelColor(place, peel), shareAbove(peel, 0.15, footprint));
    }
    if (pulp > 0) {
      sample.color = mix(sample.color, vesicles(place, segment, wobble), pulp);
      sample.gloss = static_cast<float>(0.45 * pulp);
    }
    return sample;
  }

  Vec3f peelColor(const Place& place, const Varying& peel) const {
    // Oil glands: clear drops in the zest.
    const Cell gland = cellAt(kGlands * place.ball, 0.8, seed_ + 3);
    const double kept = place.footprint.scaled(kGlands).kept(2 * kCellSpread);
    const double drop = mix(0.15, shareAbove(0.3 - gland.center, 0.12, place.footprint), kept);
    return mix(peel_.mean(peel, place.footprint), kGland, 0.6 * drop);
  }

  /// Spindles that point from the rind to the axis and narrow as they go.
  Vec3f vesicles(const Place& place, const Segment& segment, const Varying& wobble) const {
    const Footprint& footprint = place.footprint;
    const Fan fan(place.ball, kAxisHalfLength);
    // On a sphere of this radius cells have the size of a vesicle at 0.7 of the ball; a slow growth along the
    // fan makes them as long as eight of those.
    const double radius = 0.7 / vesicle_;
    const Varying along = 0.12 * fan.distance / vesicle_;
    VaryingPoint domain = (radius + along + 0.5 * wobble) * fan.direction;
    domain.z = domain.z + fan.foot / vesicle_;
    const Footprint inDomain = footprint.in(domain);
    const Cell cell = cellAt(domain, 0.9, seed_ + 31 * static_cast<std::uint32_t>(segment.index + 1));
    const double kept = inDomain.kept(kCellSpread);
    const Varying streaks = fanStreaks(fan, footprint, {0.01, 10}, seed_ + 4);

    const auto shares = cell.shares(0.1, footprint);
    double tone = 0;
    for (int i = 0; i < 3; ++i) tone += shares[i] * uniform(cell.hash[i], 1);
    // A drop of juice is bright in its middle and deep at its side.
    const double round = 0.35 * (1 - std::min(1.0, 1.6 * cell.center.value));
    const double light = mix(0.5, 0.12 + 0.55 * tone + round, kept) + 0.05 * streaks.value;
    Vec3f color = juice_.mean(light, 0.1);
    const double wall = shareWithin(cell.walls[0], 0.03, 0.07, footprint);
    color = mix(color, kVesicleWall, mix(0.09, 0.45 * wall, kept));
    // The segment's own skin.
    const double skin = shareAbove(0.012 - segment.depth, 0.016, footprint);
    return mix(color, kSegmentSkin, 0.75 * skin);
  }

  /// Pores over oil glands: small pits, a shade deeper.
  TextureSample skin(const Place& place) const {
    const VaryingPoint& p = place.ball;
    const VaryingPoint domain = kGlands * p;
    const Cell pore = cellAt(domain, 0.8, seed_ + 3);
    const double kept = place.footprint.scaled(kGlands).kept(kCellSpread);
    // Across the skin alone: every gland has its pore, however deep it lies. In units of the lattice.
    const Vec3 normal = p.value() / std::max(p.value().norm(), kTiny);
    const Vec3 fromGland = pore.center.value / kGlands * pore.center.gradient;
    const Vec3 fromPore = fromGland - fromGland.dot(normal) * normal;
    const double pit = std::exp(-9 * fromPore.squaredNorm());

    const Varying tone = fractalNoise(p, place.footprint, {2.0, 3, 0.5}, seed_ + 5);
    TextureSample sample;
    sample.color = skinColor_.mean(tone - 0.7 * mix(0.25, pit, kept), place.footprint);
    sample.gloss = 0.6f;
    // Of -depth * pit.
    sample.heightGradient = kept * dimples_ * 0.004 * 18 * pit * kGlands * fromPore;
    addStar(place, sample);
    return sample;
  }

  /// Where the stem was.
  void addStar(const Place& place, TextureSample& sample) const {
    if (place.ball.z.value < 0) return;
    const Varying across = hypot(place.ball.x, place.ball.y);
    const double star = shareAbove(0.045 - across, 0.02, place.footprint);
    sample.color = mix(sample.color, kStem, star);
    sample.gloss *= static_cast<float>(1 - star);
    sample.heightGradient += 0.5 * std::exp(-std::pow(across.value / 0.09, 2)) * across.gradient;
  }

  int segments_;
  double membrane_, core_, zest_, pith_, vesicle_, dimples_;
  std::uint32_t seed_;
  Ramp juice_, white_, peel_, skinColor_;
};

}  // namespace

ProceduralTexture orange() {
  return {{"orange",
           "orange: segments of juice vesicles, white membranes and pith, dimpled zest",
           {{"segments", 10, 5, 16, "segments around the axis"},
            {"membrane", 0.016, 0, 0.1, "thickness of the walls between segments"},
            {"core", 0.045, 0.01, 0.3, "radius of the pale core"},
            {"pith", 0.055, 0.01, 0.3, "thickness of the white pith"},
            {"zest", 0.045, 0.01, 0.2, "thickness of the colored peel"},
            {"vesicle", 0.06, 0.02, 0.3, "width of a juice vesicle"},
            {"dimples", 1, 0, 3, "depth of the pores of the skin, over that of the real fruit"},
            kSeedParameter}},
          makeOf<Orange>};
}

}  // namespace polestar::detail
