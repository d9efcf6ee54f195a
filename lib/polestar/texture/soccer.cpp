// Ball coordinates made visible: the panels of a soccer ball along directions, times bands of radius. A
// direction keeps its panel all the way to the center, so on a cut the seams are the curves of constant
// direction, and the edges of the bands those of constant radius.

#include <cmath>

#include "polestar/io/picture.h"
#include "polestar/texture/detail/point_texture.h"
#include "polestar/texture/detail/procedural_texture.h"
#include "polestar/texture/detail/ramp.h"
#include "polestar/texture/soccer_panel.h"

namespace polestar::detail {
namespace {

/// What a kind of panel looks like from the center out: warm towards the center, the skin's colors at the
/// rim; every other band, not the last, a shade deeper.
struct PanelColors {
  std::uint32_t skin, rim, core, shade;
};
constexpr PanelColors kHexagon{0xf2e8d5, 0xefdcba, 0xc4583a, 0xd2a26c};
constexpr PanelColors kPentagon{0x1d2f4f, 0x24406b, 0x5f8f86, 0x6d93a0};
constexpr std::uint32_t kCore = 0xe9b44c, kLine = 0x1b2033;
constexpr double kPole = 0.018;  // radius of the dot at the center

/// Of the sphere's area; the other panels are hexagons.
constexpr double kPentagonShare = 0.285;
/// Waves per radian of the panels, in terms of Footprint::kept.
constexpr double kPanelSpread = 2.5;

struct Bands {
  int count;
  double line, skin;
};

Ramp radialRamp(const PanelColors& colors, const Bands& bands) {
  const Vec3f line = linearFromSrgb(kLine);
  std::vector<Ramp::Stop> stops{{kPole, line}};
  double from = kPole;
  auto add = [&](const Vec3f& color, double to) {
    stops.push_back({from, color});
    stops.push_back({to, color});
    from = to;
  };
  for (int band = 0; band < bands.count; ++band) {
    const double edge = (band + 1.0) / bands.count;
    const bool last = band + 1 == bands.count;
    const double towardsRim = smoothStep(0.1, 0.95, (band + 0.5) / bands.count);
    const Vec3f plain = mix(linearFromSrgb(colors.core), linearFromSrgb(colors.rim), towardsRim);
    const Vec3f shaded = mix(plain, linearFromSrgb(colors.shade), band % 2 == 0 ? 0.42 : 0);
    const double end = last ? 1 - bands.skin : edge - bands.line / 2;
    add(band == 0 ? linearFromSrgb(kCore) : shaded, std::max(from, end));
    if (!last) add(line, std::max(from, edge + bands.line / 2));
  }
  add(linearFromSrgb(colors.skin), 2);
  return Ramp(std::move(stops));
}

class Soccer final : public PointTexture {
 public:
  explicit Soccer(const Parameters& p)
      : bands_{p.count("bands"), p["line"], p["skin"]},
        seam_(p["seam"]),
        groove_(p["groove"]),
        hexagon_(radialRamp(kHexagon, bands_)),
        pentagon_(radialRamp(kPentagon, bands_)),
        line_(linearFromSrgb(kLine)) {}

 private:
  TextureSample at(const Place& place) const override {
    const SoccerPanel panel = soccerPanel(place.ball.value());
    // In ball radii from the plane of the nearest seam, which holds the center.
    const Varying fromSeam(place.radius.value * panel.seamDistance, panel.seamNormal);
    const double detail = place.footprint.kept(kPanelSpread / std::max(place.radius.value, kTiny));

    TextureSample sample;
    const Vec3f hexagon = hexagon_.mean(place.radius, place.footprint);
    const Vec3f pentagon = pentagon_.mean(place.radius, place.footprint);
    const double own = shareAbove(fromSeam, 0, place.footprint);
    const double pentagons = mix(SoccerPanel::isPentagon(panel.neighbour), panel.pentagon(), own);
    sample.color = mix(hexagon, pentagon, mix(kPentagonShare, pentagons, detail));

    const double outside = shareAbove(place.radius - (1 - bands_.skin), 0, place.footprint);
    // The ball of R < 1 / bands has one color. Within, seams are as thin as the lines between bands.
    const double seamed = shareAbove(place.radius - 1.0 / bands_.count, 0, place.footprint);
    const double width = mix(bands_.line, seam_, outside);
    const double seam = shareWithin(fromSeam, width / 2, 0, place.footprint);
    sample.color = mix(sample.color, line_, detail * seamed * seam);
    sample.gloss = static_cast<float>(0.6 * outside);
    sample.heightGradient = outside * detail * grooveSlope(fromSeam, place.footprint);
    return sample;
  }

  /// Of a groove that is wider than its dark line, so that light runs along its rims.
  Vec3 grooveSlope(const Varying& fromSeam, const Footprint& footprint) const {
    const double squared = std::max(seam_ * seam_ + std::pow(footprint.width(fromSeam), 2), kTiny);
    const double t = fromSeam.value * fromSeam.value / squared;
    return 2 * groove_ * seam_ / squared * fromSeam.value * std::exp(-t) * fromSeam.gradient;
  }

  Bands bands_;
  double seam_, groove_;
  Ramp hexagon_, pentagon_;
  Vec3f line_;
};

}  // namespace

ProceduralTexture soccer() {
  return {{"soccer",
           "panels of a soccer ball times bands of radius: shows ball coordinates themselves",
           {{"bands", 10, 1, 100, "bands between the center and the skin"},
            {"line", 0.006, 0, 0.05, "width of the lines between bands, and of seams inside"},
            {"skin", 0.02, 0, 0.2, "thickness of the skin"},
            {"seam", 0.016, 0, 0.1, "width of the seams between panels on the skin"},
            {"groove", 0.45, 0, 2, "depth of the seams' groove over their width"}}},
          makeOf<Soccer>};
}

}  // namespace polestar::detail
