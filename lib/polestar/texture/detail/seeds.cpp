#include "polestar/texture/detail/seeds.h"

#include <numbers>

#include "polestar/texture/detail/hash.h"

namespace polestar::detail {
namespace {

constexpr double kPi = std::numbers::pi;

/// A frame at a seed's middle: the columns look along it (outwards), around the axis and along the meridian.
struct SeedFrame {
  Vec3 middle;
  Mat3 axes;
};

SeedFrame seedFrame(const SeedLayout& layout, double longitude, double latitude, double offset) {
  const double cosine = std::cos(latitude), sine = std::sin(latitude);
  const Vec3 outward(std::cos(longitude), std::sin(longitude), 0), around(-outward[1], outward[0], 0);
  const Vec3 normal =
      (outward * (cosine / layout.equator) + Vec3::UnitZ() * (sine / layout.pole)).normalized();
  SeedFrame frame;
  frame.middle = outward * (layout.equator * cosine) + Vec3::UnitZ() * (layout.pole * sine) + offset * normal;
  frame.axes << normal, around, normal.cross(around);
  return frame;
}

/// A drop: half width sqrt(1 - u^2) (1 + u / 2), so the round end is three times as wide as the tip. The form
/// is 1 on the surface; averaged over the footprint to second order.
Varying dropForm(const VaryingPoint& ball, const Footprint& footprint, const SeedFrame& frame,
                 const SeedLayout& layout) {
  const Vec3 d = frame.axes.transpose() * (ball.value() - frame.middle);
  const Varying u(d[0] * 2 / layout.length, frame.axes.col(0) * (2 / layout.length));
  const Varying v(d[1] * 2 / layout.width, frame.axes.col(1) * (2 / layout.width));
  const Varying w(d[2] * 2 / layout.thickness, frame.axes.col(2) * (2 / layout.thickness));
  const Varying taper = max(0.75 + 0.4 * u, 0.3);
  Varying form = u * u + (v * v + w * w) / (taper * taper);
  const double spreadSquared =
      std::pow(footprint.width(u), 2) + std::pow(footprint.width(v), 2) + std::pow(footprint.width(w), 2);
  form.value += spreadSquared / 12;
  form.variance += spreadSquared * spreadSquared / 180;
  return form;
}

/// A place for a seed. Rows have even heights along the axis, which is an even share of the shell for each.
struct SeedCell {
  int row, column, around;
  double sine;  ///< of the latitude of its middle, before jitter
};

/// The whole number nearest to x, or the second nearest.
int nearest(double x, bool second) {
  const auto first = static_cast<int>(std::lround(x));
  return second ? first + (x < first ? -1 : 1) : first;
}

/// Columns, and rows but for the columns' shifts, have their middles at whole numbers: cuts along the axes
/// meet seeds.
SeedCell cellNear(const SeedLayout& layout, double sine, double turn, bool secondRow, bool secondColumn) {
  const double rows = layout.rows / 2.0;
  SeedCell cell{0, 0, layout.around, 0};
  if (layout.thinning) {
    cell.row = nearest(sine * rows, secondRow);
    cell.sine = cell.row / rows;
    const double cosine = std::sqrt(std::max(0.0, 1 - cell.sine * cell.sine));
    cell.around = std::max(1, static_cast<int>(std::lround(layout.around * cosine)));
  }
  const int column = nearest(turn * cell.around, secondColumn) % cell.around;
  cell.column = column < 0 ? column + cell.around : column;
  if (!layout.thinning) {
    // Columns are shifted against each other: no cut runs between all rows.
    const double shift = uniform(latticeHash(cell.column, 0, 0, layout.seed + 1));
    cell.row = nearest(sine * rows + shift, secondRow);
    cell.sine = (cell.row - shift) / rows;
  }
  return cell;
}

/// Volume of a drop over that of its cell, spread over the shell that seeds lie in.
double density(double level, double reach, const Footprint& footprint, const SeedLayout& layout) {
  constexpr double kDropOverBox = 0.3;
  const double drop = kDropOverBox * layout.length * layout.width * layout.thickness;
  const double cell = layout.equator * 2 * kPi / layout.around * layout.pole * 2 / layout.rows;
  const double half = reach * layout.equator, blur = footprint.size();
  const double fromShell = std::abs(level - 1) * layout.equator;
  const double shell =
      std::clamp((half - fromShell) / std::max(blur, kTiny) + 0.5, 0.0, 1.0) * half / (half + blur / 2);
  return layout.presence * drop / (cell * 2 * half) * shell;
}

/// Takes the cell's seed for `seed` when it is there and nearer.
void consider(const VaryingPoint& ball, const Footprint& footprint, const SeedLayout& layout,
              const SeedCell& cell, Seed& seed) {
  const std::uint32_t hash = latticeHash(cell.row, cell.column, cell.around, layout.seed);
  if (uniform(hash, 0) > layout.presence || std::abs(cell.sine) > 0.97) return;
  // Where columns close in on each other there is no room.
  const double latitude = std::asin(cell.sine);
  const double room = layout.equator * std::cos(latitude) * 2 * kPi / cell.around;
  if (room < layout.width) return;
  auto jitter = [&](std::uint32_t n, double space) { return space * (uniform(hash, n) - 0.5); };
  const double longitude = (cell.column + jitter(1, 0.8 * (1 - layout.width / room))) * 2 * kPi / cell.around;
  const SeedFrame frame =
      seedFrame(layout, longitude, latitude + jitter(2, 0.6 / layout.rows), jitter(3, 2 * layout.scatter));
  const Vec3 offset = ball.value() - frame.middle;
  if (offset.norm() > 1.2 * layout.length + footprint.size()) return;

  const Varying form = dropForm(ball, footprint, frame, layout);
  if (seed.present && form.value >= seed.form.value) return;
  seed.present = true;
  seed.hash = hash;
  seed.form = form;
  seed.along = 2 * offset.dot(frame.axes.col(0)) / layout.length;
  seed.across = 2 * offset.dot(frame.axes.col(1)) / layout.width;
}

}  // namespace

double Seed::share(double scale, double softness, const Footprint& footprint) const {
  const double own = present ? shareAbove(scale * scale - form, softness, footprint) : 0;
  return mix(std::min(1.0, density * scale * scale * scale), own, kept);
}

Seed seedNear(const VaryingPoint& ball, const Footprint& footprint, const SeedLayout& layout) {
  const Vec3 p = ball.value();
  const double acrossSquared = (p[0] * p[0] + p[1] * p[1]) / (layout.equator * layout.equator);
  const double level = std::sqrt(acrossSquared + p[2] * p[2] / (layout.pole * layout.pole));
  const double reach = (layout.scatter + 0.7 * layout.length) / layout.equator;
  if (std::abs(level - 1) > reach + 1.5 * footprint.size() / layout.equator) return {};

  Seed seed;
  seed.kept = footprint.kept(2 / layout.width);
  seed.density = seed.kept < 1 ? density(level, reach, footprint, layout) : 0;
  const double sine = p[2] / (layout.pole * std::max(level, kTiny));
  const double turn = std::atan2(p[1], p[0]) / (2 * kPi);
  for (const bool secondRow : {false, true}) {
    for (const bool secondColumn : {false, true}) {
      consider(ball, footprint, layout, cellNear(layout, sine, turn, secondRow, secondColumn), seed);
    }
  }
  return seed;
}

}  // namespace polestar::detail
