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

struct Cell {
  int row, column, around;
  double shift;  ///< of the rows of this column, in rows
};

double rowHeight(const SeedLayout& layout) { return kPi / layout.rows; }

/// Cells around the axis have their middles at whole numbers, and even rows a row at the equator: cuts along
/// the axes meet seeds.
Cell cellAt(const SeedLayout& layout, double latitude, double turn) {
  const double row = latitude / rowHeight(layout);
  auto columnOf = [&](int around) {
    return (static_cast<int>(std::lround(turn * around)) + around) % around;
  };
  Cell cell;
  if (layout.thinning) {
    cell.shift = 0.5;
    cell.row = static_cast<int>(std::floor(row + cell.shift));
    const double cosine = std::cos(cell.row * rowHeight(layout));
    cell.around = std::max(1, static_cast<int>(layout.around * cosine + 0.5));
    cell.column = columnOf(cell.around);
  } else {
    cell.around = layout.around;
    cell.column = columnOf(cell.around);
    // Columns are shifted against each other: no cut runs between all rows.
    cell.shift = uniform(latticeHash(cell.column, 0, 0, layout.seed + 1));
    cell.row = static_cast<int>(std::floor(row + cell.shift));
  }
  return cell;
}

}  // namespace

Seed seedNear(const VaryingPoint& ball, const Footprint& footprint, const SeedLayout& layout) {
  const Vec3 p = ball.value();
  const double across = std::hypot(p[0], p[1]);
  const double level = std::hypot(across / layout.equator, p[2] / layout.pole);
  const double reach = (layout.scatter + 0.7 * layout.length) / layout.equator;
  if (std::abs(level - 1) > reach + footprint.size()) return {};

  const double latitude = std::atan2(p[2] / layout.pole, across / layout.equator);
  const double turn = std::atan2(p[1], p[0]) / (2 * kPi);
  const Cell cell = cellAt(layout, latitude, turn);
  const double middleLatitude = (cell.row + 0.5 - cell.shift) * rowHeight(layout);

  Seed seed;
  seed.hash = latticeHash(cell.row, cell.column, cell.around, layout.seed);
  // Where rows around the poles close in on each other there is no room.
  const double room = layout.equator * std::cos(middleLatitude) * 2 * kPi / cell.around;
  if (uniform(seed.hash, 0) > layout.presence || room < layout.width) return {};
  auto jitter = [&](std::uint32_t n, double space) { return space * (uniform(seed.hash, n) - 0.5); };
  const double slack = 0.8 * std::max(0.0, 1 - layout.width / room);
  const double longitude = (cell.column + jitter(1, slack)) * 2 * kPi / cell.around;
  const SeedFrame frame = seedFrame(layout, longitude, middleLatitude + jitter(2, 0.3 * rowHeight(layout)),
                                    jitter(3, 2 * layout.scatter));
  seed.present = true;
  seed.form = dropForm(ball, footprint, frame, layout);
  const Vec3 local = frame.axes.transpose() * (p - frame.middle);
  seed.along = 2 * local[0] / layout.length;
  seed.across = 2 * local[1] / layout.width;
  return seed;
}

}  // namespace polestar::detail
