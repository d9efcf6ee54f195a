#include "polestar/polycube/detail/columns.h"

#include <algorithm>

#include "polestar/core/error.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar::detail {
namespace {

constexpr int kTableCells = 128;  // along a side of a face
constexpr int kTableNodes = kTableCells + 1;

double cubed(double t) { return t * t * t; }

/// The direction through place (u, v) of a face of the cube; faces 0 to 2 look along the axes, 3 to 5
/// against.
Vec3 throughFace(std::size_t face, double u, double v) {
  const int axis = static_cast<int>(face % 3);
  Vec3 direction;
  direction[axis] = face < 3 ? 1 : -1;
  direction[(axis + 1) % 3] = u;
  direction[(axis + 2) % 3] = v;
  return direction;
}

}  // namespace

ColumnRule::ColumnRule(int perSide) : weight_(4.0 / 3 / perSide / perSide) {
  const auto middle = [&](int i) { return (2.0 * i + 1) / perSide - 1; };
  for (std::size_t face = 0; face < 6; ++face) {
    for (int i = 0; i < perSide; ++i) {
      for (int j = 0; j < perSide; ++j) directions_.push_back(throughFace(face, middle(i), middle(j)));
    }
  }
}

struct ExactReach::Data {
  SphereLocator locator;
};

ExactReach::ExactReach(const StarShape& shape)
    : data_(new Data{SphereLocator(shape.mesh().vertices, shape.mesh().triangles)}) {}
ExactReach::~ExactReach() = default;

double ExactReach::reach(const Vec3& direction) const {
  const auto hit = data_->locator.locate(direction);
  // The surface of a StarShape covers the directions; rounding on a seam stays within the locator's
  // tolerance.
  if (!hit) throw Error(Errc::notStarShaped, "polycube: a ray from the center misses the surface");
  return data_->locator.point(*hit).cwiseAbs().maxCoeff();
}

ReachTable::ReachTable(const StarShape& shape, const Context& context)
    : values_(std::size_t{6} * kTableNodes * kTableNodes) {
  const ExactReach exact(shape);
  parallelChunks(values_.size(), kTableNodes, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto place = [](std::size_t node) { return 2.0 * static_cast<double>(node) / kTableCells - 1; };
      const Vec3 d = throughFace(i / (kTableNodes * kTableNodes), place(i / kTableNodes % kTableNodes),
                                 place(i % kTableNodes));
      values_[i] = exact.reach(d);
    }
  });
}

double ReachTable::reach(const Vec3& direction) const {
  int axis = 0;
  const double longest = direction.cwiseAbs().maxCoeff(&axis);
  const auto place = [&](int k) { return (direction[k] / longest + 1) * (0.5 * kTableCells); };
  const double u = place((axis + 1) % 3), v = place((axis + 2) % 3);
  const int i = std::min(static_cast<int>(u), kTableCells - 1),
            j = std::min(static_cast<int>(v), kTableCells - 1);
  const double a = u - i, b = v - j;
  const int face = direction[axis] < 0 ? axis + 3 : axis;
  const double* at = &values_[(static_cast<std::size_t>(face) * kTableNodes + i) * kTableNodes + j];
  return (1 - a) * ((1 - b) * at[0] + b * at[1]) + a * ((1 - b) * at[kTableNodes] + b * at[kTableNodes + 1]);
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
