#include "polestar/render/soccer_pattern.h"

#include <algorithm>
#include <cmath>

#include "polestar/io/picture.h"
#include "polestar/texture/soccer_panel.h"

namespace polestar {
namespace {

constexpr int kBands = 10;
constexpr double kPanelAngle = 0.72;  // about the width of a panel, radians

double smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Vec3f mix(const Vec3f& a, const Vec3f& b, double share) { return a + static_cast<float>(share) * (b - a); }

/// Share of a pixel at `distance` from the middle of a line of `width` that the line covers.
double lineCoverage(double distance, double width, double pixel) {
  const double drawn = std::max(width, pixel);
  return width / drawn * std::clamp((drawn - distance * 2) / (2 * pixel) + 0.5, 0.0, 1.0);
}

/// Radius, direction and how fast they change along the tangents.
struct Polar {
  double radius, radiusFirst, radiusSecond;
  Vec3 direction, directionFirst, directionSecond;

  explicit Polar(const PatternPoint& p) : radius(p.ball.norm()) {
    direction = radius > 0 ? Vec3(p.ball / radius) : Vec3(Vec3::UnitZ());
    const double safe = std::max(radius, 1e-12);
    radiusFirst = direction.dot(p.alongFirst);
    radiusSecond = direction.dot(p.alongSecond);
    directionFirst = (p.alongFirst - radiusFirst * direction) / safe;
    directionSecond = (p.alongSecond - radiusSecond * direction) / safe;
  }

  double radiusSlope() const { return std::max(std::hypot(radiusFirst, radiusSecond), 1e-9); }
  double directionSlope() const {
    return std::max(std::sqrt(directionFirst.squaredNorm() + directionSecond.squaredNorm()), 1e-9);
  }
};

/// Distance to the nearest seam as a length on the surface, and its gradient there.
struct Seam {
  double distance, first, second;
  double shown;  ///< falls to 0 where the seam runs within the surface that is seen: it would cover all of it
  Seam(const SoccerPanel& panel, const Polar& polar) {
    first = panel.seamNormal.dot(polar.directionFirst);
    second = panel.seamNormal.dot(polar.directionSecond);
    const double slope = std::hypot(first, second);
    const double steepest = polar.directionSlope();
    shown = smoothStep(0.12, 0.35, slope / steepest);
    const double safe = std::max(slope, 0.12 * steepest);
    first /= safe;
    second /= safe;
    distance = panel.seamDistance / safe;
  }
};

/// How much of the pixel iso-lines of the radius cover: those at k/10, and finer ones between them where the
/// bands are wide, so that the lines lie about evenly over the whole cut.
double isoLines(const Polar& polar, double spacing, const PatternPoint& point) {
  double covered = 0;
  double step = 1.0 / kBands;
  for (int level = 0; level < 4; ++level, step /= 2, spacing /= 2) {
    const long nearest = std::lround(polar.radius / step);
    if (nearest == 0 || (level > 0 && (nearest % 2 == 0 || polar.radius < 1.0 / kBands))) continue;
    const double distance =
        std::abs(polar.radius - static_cast<double>(nearest) * step) / polar.radiusSlope();
    const double width = std::min((level == 0 ? 1.0 : 0.5) * point.lineWidth, 0.15 * spacing);
    // At R = 1 an inexact map may stay flat over a whole region.
    if (nearest == kBands && level == 0 && polar.radiusSlope() < 0.1) continue;
    const double shown = level == 0 ? smoothStep(1.5, 4, spacing / point.pixel)
                                    : 0.8 * smoothStep(6, 12, spacing / point.lineWidth);
    covered = std::max(covered, shown * lineCoverage(distance, width, point.pixel));
  }
  return covered;
}

}  // namespace

Palette::Palette()
    : hexagon(linearFromSrgb(0xf2e8d5)),
      pentagon(linearFromSrgb(0x1d2f4f)),
      hexagonRim(linearFromSrgb(0xefdcba)),
      pentagonRim(linearFromSrgb(0x24406b)),
      hexagonCore(linearFromSrgb(0xc4583a)),
      pentagonCore(linearFromSrgb(0x5f8f86)),
      hexagonShade(linearFromSrgb(0xd2a26c)),
      pentagonShade(linearFromSrgb(0x6d93a0)),
      core(linearFromSrgb(0xe9b44c)),
      pole(linearFromSrgb(0x1b2033)),
      line(linearFromSrgb(0x1b2033)),
      background(linearFromSrgb(0xe6e1d9)),
      unmapped(linearFromSrgb(0x9a9a9a)) {}

PatternValue skinPattern(const PatternPoint& point, const Palette& palette) {
  const Polar polar(point);
  const SoccerPanel panel = soccerPanel(polar.direction);
  const Seam seam(panel, polar);
  const double panelSize = kPanelAngle / polar.directionSlope();
  const double width = std::min(2.5 * point.lineWidth, 0.12 * panelSize);
  const double detail = smoothStep(2, 8, panelSize / point.pixel);

  PatternValue value;
  const Vec3f mean = mix(palette.hexagon, palette.pentagon, 0.3);
  value.albedo = mix(mean, panel.pentagon() ? palette.pentagon : palette.hexagon, detail);
  value.albedo =
      mix(value.albedo, palette.line, detail * seam.shown * lineCoverage(seam.distance, width, point.pixel));
  // The groove is wider than its dark line, so that light runs along its rims.
  const double t = seam.distance / width;
  const double slope = detail * seam.shown * 0.9 * t * std::exp(-t * t);
  value.slopeFirst = slope * seam.first;
  value.slopeSecond = slope * seam.second;
  return value;
}

PatternValue cutPattern(const PatternPoint& point, const Palette& palette) {
  const Polar polar(point);
  const SoccerPanel panel = soccerPanel(polar.direction);
  const Seam seam(panel, polar);
  const double spacing = 1.0 / kBands / polar.radiusSlope();
  const double panelSize = kPanelAngle / polar.directionSlope();

  // Panels: warm towards the center, the skin's colors at the rim; every other band, not the last, a shade
  // deeper.
  const int band = std::min(kBands - 1, static_cast<int>(polar.radius * kBands));
  const double towardsRim = smoothStep(0.1, 0.95, (band + 0.5) / kBands);
  const double panels = smoothStep(2, 8, panelSize / point.pixel);
  const double bands = smoothStep(1.5, 4, spacing / point.pixel);
  const double shade = 0.42 * (band % 2 == 0 ? 0.5 + 0.5 * bands : 0.5 - 0.5 * bands);
  const Vec3f hexagon =
      mix(mix(palette.hexagonCore, palette.hexagonRim, towardsRim), palette.hexagonShade, shade);
  const Vec3f pentagon =
      mix(mix(palette.pentagonCore, palette.pentagonRim, towardsRim), palette.pentagonShade, shade);
  Vec3f color = mix(mix(hexagon, pentagon, 0.3), panel.pentagon() ? pentagon : hexagon, panels);
  if (band == 0) color = palette.core;

  if (band > 0) {
    const double width = std::min(point.lineWidth, 0.06 * panelSize);
    color = mix(color, palette.line, panels * seam.shown * lineCoverage(seam.distance, width, point.pixel));
  }
  color = mix(color, palette.line, isoLines(polar, spacing, point));
  // The pole: a dot, which takes its share of a pixel that is larger than itself.
  const double dot = 0.018 / polar.radiusSlope(), fromPole = polar.radius / polar.radiusSlope();
  const double share = std::min(1.0, 4 * dot * dot / (point.pixel * point.pixel));
  color = mix(color, palette.pole, share * std::clamp(0.5 + (dot - fromPole) / point.pixel, 0.0, 1.0));

  PatternValue value;
  value.albedo = color;
  return value;
}

}  // namespace polestar
