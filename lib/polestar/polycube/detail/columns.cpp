#include "polestar/polycube/detail/columns.h"

#include <algorithm>

#include "polestar/sphere/reach.h"

namespace polestar::detail {
namespace {

double cubed(double t) { return t * t * t; }

}  // namespace

ColumnRule::ColumnRule(int perSide) : weight_(4.0 / 3 / perSide / perSide) {
  const auto middle = [&](int i) { return (2.0 * i + 1) / perSide - 1; };
  for (std::size_t face = 0; face < 6; ++face) {
    for (int i = 0; i < perSide; ++i) {
      for (int j = 0; j < perSide; ++j) directions_.push_back(throughCubeFace(face, middle(i), middle(j)));
    }
  }
}

std::vector<double> columnLengths(const ColumnRule& rule, const CellBox& box, std::span<const char> filled) {
  std::vector<double> lengths(rule.size());
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    walkCells(rule.direction(i), std::numeric_limits<double>::infinity(),
              [&](const Cell& cell, double, double end) {
                if (!box.contains(cell) || !filled[box.index(cell)]) return false;
                lengths[i] = end;
                return true;
              });
  }
  return lengths;
}

CellMeasure::CellMeasure(const ColumnRule& rule, int farthest)
    : octant_{{0, 0, 0}, {farthest, farthest, farthest}}, volume_(octant_.size()) {
  for (std::size_t i = 0; i < rule.size(); ++i) {
    const Vec3 direction = rule.direction(i);
    if (direction.minCoeff() < 0) continue;
    walkCells(direction, farthest + 0.5, [&](const Cell& cell, double begin, double end) {
      volume_[octant_.index(cell)] += rule.weight() * (cubed(end) - cubed(begin));
      return true;
    });
  }
}

double CellMeasure::of(const Cell& cell) const {
  // Of a cell that reaches into other octants, these hold mirror images.
  int octants = 1;
  for (const int index : cell) octants *= index == 0 ? 2 : 1;
  return octants * volume_[octant_.index({std::abs(cell[0]), std::abs(cell[1]), std::abs(cell[2])})];
}

CellVolumes CellMeasure::volumes(const ColumnRule& rule, std::span<const double> lengths, double cellSide,
                                 const CellBox& box) const {
  CellVolumes result{box, std::vector<double>(box.size()), std::vector<double>(box.size()), 0};
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double length = lengths[i] / cellSide;
    result.solid += rule.weight() * cubed(length);
    walkCells(rule.direction(i), length, [&](const Cell& cell, double begin, double end) {
      // A ray does not come back into a box that it has left.
      if (!box.contains(cell)) return false;
      result.inside[box.index(cell)] += rule.weight() * (cubed(end) - cubed(begin));
      return true;
    });
  }
  Cell cell;
  for (cell[0] = box.min[0]; cell[0] <= box.max[0]; ++cell[0]) {
    for (cell[1] = box.min[1]; cell[1] <= box.max[1]; ++cell[1]) {
      for (cell[2] = box.min[2]; cell[2] <= box.max[2]; ++cell[2]) result.all[box.index(cell)] = of(cell);
    }
  }
  return result;
}

BestScale bestScale(std::span<const double> fixed, std::span<const double> scaled) {
  struct Column {
    double ratio, fixed, scaled;  ///< of the lengths; their cubes
  };
  std::vector<Column> columns;
  columns.reserve(fixed.size());
  double shortFixed = 0, longFixed = 0;    // sums of cubes, where it is the shorter or the longer of the two
  double shortScaled = 0, longScaled = 0;  // likewise; at scale 0 all of the scaled set is short
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    columns.push_back({fixed[i] / scaled[i], cubed(fixed[i]), cubed(scaled[i])});
    longFixed += columns.back().fixed;
    shortScaled += columns.back().scaled;
  }
  std::ranges::sort(columns, {}, &Column::ratio);
  BestScale best;
  for (const Column& column : columns) {
    const double cube = cubed(column.ratio);
    const double overlap = (shortFixed + cube * shortScaled) / (longFixed + cube * longScaled);
    if (overlap > best.overlap) best = {column.ratio, overlap};
    shortFixed += column.fixed;
    longFixed -= column.fixed;
    longScaled += column.scaled;
    shortScaled -= column.scaled;
  }
  return best;
}

}  // namespace polestar::detail
