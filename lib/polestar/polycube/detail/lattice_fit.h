#pragma once
// The best polycube for given axes: which cells, and how large they are.

#include <vector>

#include "polestar/polycube/detail/columns.h"

namespace polestar::detail {

/// A set of cells in place.
struct LatticeFit {
  CellBox box;
  std::vector<char> filled;  ///< of the box's cells
  double cellSide = 0;       ///< inner units
  double overlap = 0;        ///< with the solid, by columns
};

Polycube polycubeOf(const LatticeFit& fit);

/// Fits polycubes of at most `cells` cells a side to solids given by their columns. Thread-safe.
class LatticeFitter {
 public:
  LatticeFitter(int cells, int columnsPerSide);

  const ColumnRule& rule() const { return rule_; }

  /// Tries some sizes of the cells; from the best, the best set for the size and the best size for the set by
  /// turns, until neither gains. Never worse from one to the next.
  LatticeFit fit(std::span<const double> lengths) const;

  /// The overlap that the best of these sizes reaches: fit() gains a little more.
  double overlap(std::span<const double> lengths) const { return firstFit(lengths).overlap; }

  /// Of the sets whose faces lie in few planes of the lattice of `fit`, one that keeps `overlap`: planes are
  /// given up one after the other, always the one that costs the least, as long as the best set without it
  /// overlaps the solid enough. Each choice is the right one; all of them together need not be the best.
  LatticeFit withFewPlanes(std::span<const double> lengths, const LatticeFit& fit, double overlap) const;

 private:
  LatticeFit firstFit(std::span<const double> lengths) const;
  LatticeFit bestSet(std::span<const double> lengths, double cellSide) const;

  int cells_;
  ColumnRule rule_;
  CellMeasure measure_;
};

}  // namespace polestar::detail
