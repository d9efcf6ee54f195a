#include "polestar/render/iso_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "polestar/texture/soccer_panel.h"

namespace polestar {
namespace {

constexpr int kBands = 10;
constexpr double kPanelAngle = 0.72;  // about the width of a panel of the soccer ball, radians
constexpr double kGraticule = std::numbers::pi / 12;

double smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Share of a window of `window` pixels that a line of `width` pixels covers whose middle is `distance`
/// pixels away.
double lineCoverage(double distance, double width, double window) {
  const double drawn = std::max(width, window);
  return width / drawn * std::clamp((drawn - 2 * distance) / (2 * window) + 0.5, 0.0, 1.0);
}

struct Lines {
  const IsoLines& options;
  const BallFootprint& at;
  double share, radius;
  Vec3 direction;

  /// Change of a quantity with this gradient over the pixel.
  double spread(const Vec3& gradient) const {
    return std::max(std::hypot(gradient.dot(at.overFirst), gradient.dot(at.overSecond)), 1e-12);
  }

  /// Those of R, so that they lie about evenly over the whole cut.
  double radii() const {
    const double change = spread(direction);
    double covered = 0, step = 1.0 / kBands, spacing = step / change;
    for (int level = 0; level < 4; ++level, step /= 2, spacing /= 2) {
      const long nearest = std::lround(radius / step);
      // R = 1 is the solid's edge, which is seen anyway; where R stays close to 1 over a whole region, as in
      // narrow corners, its last digits would draw.
      if (nearest == 0 || (level == 0 && nearest == kBands) ||
          (level > 0 && (nearest % 2 == 0 || radius < 1.0 / kBands)))
        continue;
      const double distance = std::abs(radius - static_cast<double>(nearest) * step) / change;
      const double width = std::min((level == 0 ? 1.0 : 0.5) * options.pixels, 0.15 * spacing);
      const double shown =
          level == 0 ? smoothStep(1.5, 4, spacing) : 0.8 * smoothStep(11, 18, spacing / options.pixels);
      covered = std::max(covered, shown * lineCoverage(distance, width, share));
    }
    return covered;
  }

  double graticule() const {
    const double ring = std::hypot(direction[0], direction[1]);
    const double latitude = std::atan2(direction[2], ring);
    // Gradients of latitude and longitude times the ring's radius, so that the pole is no exception.
    const Vec3 east = ring > 0 ? Vec3(-direction[1] / ring, direction[0] / ring, 0) : Vec3(Vec3::UnitX());
    const Vec3 north = direction.cross(east);
    const auto one = [&](double angle, double scale, double change) {
      const double spacing = kGraticule * scale / change;
      const double distance = std::abs(angle - kGraticule * std::round(angle / kGraticule)) * scale / change;
      const double width = std::min(options.pixels, 0.15 * spacing);
      return smoothStep(1.5, 6, spacing) * lineCoverage(distance, width, share);
    };
    const double changeNorth = spread(north) / radius, changeEast = spread(east) / radius;
    const double parallels =
        std::abs(latitude) > std::numbers::pi / 2 - 0.5 * kGraticule ? 0 : one(latitude, 1, changeNorth);
    return std::max(parallels, one(std::atan2(direction[1], direction[0]), ring, changeEast));
  }

  double seams() const {
    const SoccerPanel panel = soccerPanel(direction);
    const Vec3 gradient = panel.seamNormal - panel.seamNormal.dot(direction) * direction;
    const double steepest =
        std::sqrt(std::max({(at.overFirst - direction.dot(at.overFirst) * direction).squaredNorm() +
                                (at.overSecond - direction.dot(at.overSecond) * direction).squaredNorm(),
                            1e-24}));
    const double change = spread(gradient);
    // A seam that runs within the surface that is seen would cover all of it.
    const double shown = smoothStep(0.12, 0.35, change / steepest);
    const double spacing = kPanelAngle * radius / steepest;
    const double width = std::min(options.pixels, 0.06 * spacing);
    return shown * smoothStep(2, 8, spacing) *
           lineCoverage(panel.seamDistance * radius / std::max(change, 0.12 * steepest), width, share);
  }
};

}  // namespace

double isoLineCoverage(const IsoLines& lines, const BallFootprint& at, double share) {
  const double radius = at.ball.norm();
  if (!(radius > 1e-9)) return 0;
  const Lines drawn{lines, at, share, radius, at.ball / radius};
  double covered = 0;
  if (lines.radius && !at.skin) covered = std::max(covered, drawn.radii());
  if (lines.graticule && at.skin) covered = std::max(covered, drawn.graticule());
  if (lines.skinSeams && at.skin) covered = std::max(covered, drawn.seams());
  // Near the center seams come too close to each other.
  if (lines.cutSeams && !at.skin && radius > 1.0 / kBands) covered = std::max(covered, drawn.seams());
  return covered;
}

}  // namespace polestar
