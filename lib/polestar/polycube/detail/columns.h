#pragma once
// Volumes of star-shaped sets by columns that leave the center: pyramids over the squares of a cube's faces.
//
// A column's direction has largest component 1; cut off where that component is t, it has volume weight t^3,
// so a set that reaches to t_i along column i has volume weight * sum t_i^3. Solid, cells and polycubes are
// all measured like this, so that their shares add up; cubes are measured exactly.

#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "polestar/core/detail/parallel.h"
#include "polestar/polycube/detail/heaviest_closure.h"
#include "polestar/polycube/polycube.h"

namespace polestar::detail {

/// The directions of the columns.
class ColumnRule {
 public:
  /// perSide^2 columns on each of the six faces; even, so that none runs along a plane through the center.
  explicit ColumnRule(int perSide);

  std::size_t size() const { return directions_.size(); }
  double weight() const { return weight_; }
  const Vec3& direction(std::size_t column) const { return directions_[column]; }

 private:
  std::vector<Vec3> directions_;
  double weight_;
};

/// Calls visit(cell, begin, end) for the cells that a column meets, from the center on, up to where its
/// largest component is `length` (in cells) or visit returns false. [Amanatides & Woo 1987]
template <class Visit>
void walkCells(const Vec3& direction, double length, Visit&& visit) {
  Cell cell{0, 0, 0}, step;
  Vec3 next, stride;  // to the next plane of each axis, and from one to the next
  for (int k = 0; k < 3; ++k) {
    step[k] = direction[k] < 0 ? -1 : 1;
    stride[k] = direction[k] == 0 ? std::numeric_limits<double>::infinity() : 1 / std::abs(direction[k]);
    next[k] = 0.5 * stride[k];
  }
  for (double begin = 0; begin < length;) {
    int axis = next[0] <= next[1] ? 0 : 1;
    if (next[2] < next[axis]) axis = 2;
    const double end = std::min(next[axis], length);
    if (!visit(static_cast<const Cell&>(cell), begin, end)) return;
    cell[axis] += step[axis];
    next[axis] = (std::abs(cell[axis]) + 0.5) * stride[axis];
    begin = end;
  }
}

/// Lengths of the columns within the solid, in inner units, where the lattice's axes are the columns of
/// `axes`.
template <class Reach>
std::vector<double> columnLengths(const ColumnRule& rule, const Reach& solid, const Mat3& axes) {
  std::vector<double> lengths(rule.size());
  parallelChunks(lengths.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 turned = axes * rule.direction(i);
      lengths[i] = solid.reach(turned) / turned.cwiseAbs().maxCoeff();
    }
  });
  return lengths;
}

/// Lengths of the columns within a set of cells (1 in `filled`, box's order), in cells.
std::vector<double> columnLengths(const ColumnRule& rule, const CellBox& box, std::span<const char> filled);

/// Volumes of cells by columns, the same for all solids.
class CellMeasure {
 public:
  /// For cells up to `farthest` from the center on every axis.
  CellMeasure(const ColumnRule& rule, int farthest);

  /// Of a solid whose columns have these lengths in inner units, where a cell has side `cellSide`, for the
  /// cells of `box`.
  CellVolumes volumes(const ColumnRule& rule, std::span<const double> lengths, double cellSide,
                      const CellBox& box) const;

 private:
  double of(const Cell& cell) const;
  CellBox octant_;
  std::vector<double> volume_;  ///< of the cells with no negative index
};

/// The scale at which two star-shaped sets overlap best.
struct BestScale {
  double scale = 1;  ///< of the second set
  double overlap = 0;
};

/// Of sets given by the lengths of their columns. Exact: between two neighbours among the ratios of lengths
/// the overlap is a quotient of linear functions of scale^3, so that it is largest at one of the ratios. O(n
/// log n).
BestScale bestScale(std::span<const double> fixed, std::span<const double> scaled);

}  // namespace polestar::detail
