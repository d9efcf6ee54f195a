#include "polestar/render/iso_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "polestar/texture/soccer_panel.h"

namespace polestar {
namespace {

constexpr int kBands = 10;
constexpr double kPanelAngle = 0.72;  // about the width of a panel of the soccer ball, radians
constexpr double kBold = 1.7;         // edges of a domain, widths of its other lines
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

double spreadOf(const Vec3& gradient, const CoordinateFootprint& at) {
  return std::max(std::hypot(gradient.dot(at.overFirst), gradient.dot(at.overSecond)), 1e-12);
}

struct Lines {
  const IsoLines& options;
  const CoordinateFootprint& at;
  double share, radius;
  Vec3 direction;

  /// Change of a quantity with this gradient over the pixel.
  double spread(const Vec3& gradient) const { return spreadOf(gradient, at); }

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

Cell moved(Cell cell, int axis, int step) {
  cell[axis] += step;
  return cell;
}

/// How the surface of the lattice's polycube turns at the plane of an axis, and how coordinates on the
/// surface of a smooth solid go there with the distance s from it: as s^power. [docs/method.md, "Cubes and
/// polycubes"]
struct Turn {
  bool edge;
  double power;
};
constexpr Turn kFlat{false, 1}, kConvex{true, 0.5}, kReentrant{true, 1.5};

/// At the plane next to a place on the surface.
Turn turnAt(const Lattice& lattice, const Vec3& place, int axis) {
  const Vec3 inside = lattice.insideSurface(place);
  const Cell cell = lattice.cellAt(inside);
  // The face that the place is on: the nearest one of the cell's that looks outside.
  const double half = 0.5 * lattice.polycube.cellSide();
  Cell out{0, 0, 0};
  double nearest = half;
  for (int k = 0; k < 3; ++k) {
    const double offset = inside[k] - 2 * half * cell[k];
    const int step = offset < 0 ? -1 : 1;
    if (half - std::abs(offset) >= nearest || lattice.polycube.contains(moved(cell, k, step))) continue;
    nearest = half - std::abs(offset);
    out = {0, 0, 0};
    out[k] = step;
  }
  // Cubes are smaller than cells where these are divided.
  const double offset = place[axis] - 2 * half * cell[axis];
  const bool betweenCells = std::abs(std::abs(offset) - half) < 0.5 * lattice.side();
  if (out[axis] != 0 || !betweenCells) return kFlat;
  const Cell beside = moved(cell, axis, offset < 0 ? -1 : 1);
  if (!lattice.polycube.contains(beside)) return kConvex;
  const Cell above{beside[0] + out[0], beside[1] + out[1], beside[2] + out[2]};
  return lattice.polycube.contains(above) ? kReentrant : kFlat;
}

}  // namespace

double latticeLineCoverage(const IsoLines& lines, const Lattice& lattice, const CoordinateFootprint& at,
                           double share) {
  const double side = lattice.side();
  const double steepest = std::sqrt(at.overFirst.squaredNorm() + at.overSecond.squaredNorm());
  double covered = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double change = spreadOf(Vec3::Unit(axis), at);
    const double fromPlane =
        std::max(std::abs(std::remainder(at.place[axis] + 0.5 * side, side)), 1e-9 * side);
    if (fromPlane / change > 3 * kBold * lines.pixels + share) continue;
    const Turn turn = at.skin ? turnAt(lattice, at.place, axis) : kFlat;
    const double power = lattice.straight ? 1 : turn.power;
    const double distance = power * fromPlane / change;
    const double spacing = distance * std::pow(side / fromPlane, 1 / power);
    // The surface of the domain lies in planes of the lattice: these would cover all of it.
    const double shown = smoothStep(0.05, 0.2, change / steepest) * smoothStep(1.5, 6, spacing);
    const double width = std::min((turn.edge ? kBold : 1) * lines.pixels, 0.15 * spacing);
    covered = std::max(covered, shown * lineCoverage(distance, width, share));
  }
  return covered;
}

double isoLineCoverage(const IsoLines& lines, const CoordinateFootprint& at, double share) {
  const double radius = at.place.norm();
  if (!(radius > 1e-9)) return 0;
  const Lines drawn{lines, at, share, radius, at.place / radius};
  double covered = 0;
  if (lines.radius && !at.skin) covered = std::max(covered, drawn.radii());
  if (lines.graticule && at.skin) covered = std::max(covered, drawn.graticule());
  if (lines.skinSeams && at.skin) covered = std::max(covered, drawn.seams());
  // Near the center seams come too close to each other.
  if (lines.cutSeams && !at.skin && radius > 1.0 / kBands) covered = std::max(covered, drawn.seams());
  return covered;
}

}  // namespace polestar
