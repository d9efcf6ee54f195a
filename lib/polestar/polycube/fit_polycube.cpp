#include "polestar/polycube/fit_polycube.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "polestar/core/error.h"
#include "polestar/mesh/principal_axes.h"
#include "polestar/polycube/detail/axis_search.h"
#include "polestar/polycube/detail/lattice_fit.h"
#include "polestar/sphere/reach.h"

namespace polestar {
namespace {

using namespace detail;

constexpr int kMostCells = Polycube::kLargestIndex;
constexpr int kSearchCells = 8;      // enough to see how a solid lies
constexpr int kColumnsPerCell = 4;   // along a side
constexpr int kFewestColumns = 64;   // along a side, for what is told
constexpr int kSearchColumns = 24;   // in search of axes: shapes are compared, not told
constexpr double kClearGain = 0.01;  // of overlap, for other axes than the mesh's

int columnsFor(int cells) { return std::max(kFewestColumns, kColumnsPerCell * cells); }

/// The mesh's axes, the principal ones, and rotations around these: they turn with the solid.
std::vector<Mat3> candidateAxes(const StarShape& shape, int rotations) {
  const Mat3 principal = principalAxes(shape.mesh()).transpose();
  std::vector<Mat3> axes{Mat3::Identity(), principal};
  for (const Mat3& rotation : spreadLattices(rotations)) axes.push_back(principal * rotation);
  return axes;
}

/// What is known of one solid while its polycube is chosen.
struct Solid {
  Solid(const StarShape& star, const Context& context) : shape(star), exact(star), table(star, context) {}

  const StarShape& shape;
  ExactReach exact;
  ReachTable table;
};

/// How a solid lies shows on few cells; which of the best positions suits all of them, and how exactly, is
/// then asked of these.
Mat3 searchedAxes(const Solid& solid, const PolycubeOptions& options, const LatticeFitter& fitter,
                  const Context& context) {
  const int cells = std::min(options.cells, kSearchCells);
  const LatticeFitter coarse(cells, std::max(kSearchColumns, kColumnsPerCell * cells));
  const auto overlapOn = [&](const LatticeFitter& lattice) {
    return
        [&](const Mat3& axes) { return lattice.overlap(columnLengths(lattice.rule(), solid.table, axes)); };
  };
  const auto score = overlapOn(fitter);
  const std::vector<Mat3> ends =
      bestAxes(candidateAxes(solid.shape, options.rotations), overlapOn(coarse), context);
  const Mat3 best = *std::ranges::max_element(ends, {}, score);
  return nearestToIdentity(bestAxes({best}, score, context).front(), latticeSymmetries());
}

PolycubeFit placed(const StarShape& shape, Polycube polycube, const Mat3& axes, double cellSide,
                   double overlap) {
  const double unit = cellSide * shape.frame().unit / polycube.cellSide();
  return {std::move(polycube), shape.frame().origin, axes, unit, overlap};
}

PolycubeFit closestFit(const Solid& solid, const Mat3& axes, const LatticeFitter& fitter) {
  const LatticeFit fit = fitter.fit(columnLengths(fitter.rule(), solid.exact, axes));
  return placed(solid.shape, polycubeOf(fit), axes, fit.cellSide, fit.overlap);
}

/// Fewer corners are better, then a larger overlap, then fewer cells: what comes first in `fits`.
std::optional<PolycubeFit> fewestCorners(std::vector<std::optional<PolycubeFit>> fits) {
  std::optional<PolycubeFit> best;
  for (std::optional<PolycubeFit>& fit : fits) {
    if (!fit) continue;
    const std::size_t corners = fit->polycube.corners();
    if (!best || corners < best->polycube.corners() ||
        (corners == best->polycube.corners() && fit->overlap > best->overlap))
      best = std::move(fit);
  }
  return best;
}

std::optional<PolycubeFit> simpleFit(const Solid& solid, const Mat3& axes, int cells, double overlap) {
  const LatticeFitter fitter(cells, columnsFor(cells));
  const std::vector<double> lengths = columnLengths(fitter.rule(), solid.exact, axes);
  LatticeFit fit = fitter.fit(lengths);
  if (fit.overlap < overlap) return std::nullopt;
  fit = fitter.withFewPlanes(lengths, fit, overlap);
  return placed(solid.shape, polycubeOf(fit), axes, fit.cellSide, fit.overlap);
}

std::vector<Cell> turnedCells(const Polycube& polycube, const Mat3& symmetry) {
  std::vector<Cell> cells;
  for (const Cell& cell : polycube.cells()) {
    const Vec3 moved = symmetry * Vec3(cell[0], cell[1], cell[2]);
    cells.push_back({static_cast<int>(moved[0]), static_cast<int>(moved[1]), static_cast<int>(moved[2])});
  }
  std::ranges::sort(cells);
  return cells;
}

/// The 24 positions of a polycube on a lattice, by what they come to.
struct Positions {
  std::vector<Mat3> distinct;  ///< one of each kind
  std::vector<Mat3> same;      ///< those that change nothing
};

Positions positionsOf(const Polycube& polycube) {
  Positions positions;
  std::set<std::vector<Cell>> seen;
  for (const Mat3& symmetry : latticeSymmetries()) {
    std::vector<Cell> cells = turnedCells(polycube, symmetry);
    if (std::ranges::equal(cells, polycube.cells())) positions.same.push_back(symmetry);
    if (seen.insert(std::move(cells)).second) positions.distinct.push_back(symmetry);
  }
  return positions;
}

std::vector<double> columnLengths(const ColumnRule& rule, const Polycube& polycube) {
  std::vector<char> filled(polycube.box().size());
  for (const Cell& cell : polycube.cells()) filled[polycube.box().index(cell)] = 1;
  return detail::columnLengths(rule, polycube.box(), filled);
}

PolycubeFit bestSize(const Solid& solid, const Polycube& polycube, const Mat3& axes) {
  const ColumnRule rule(columnsFor(polycube.longestSide()));
  const BestScale size = bestScale(columnLengths(rule, solid.exact, axes), columnLengths(rule, polycube));
  return placed(solid.shape, polycube, axes, size.scale, size.overlap);
}

Mat3 searchedAxes(const Solid& solid, const Polycube& polycube, int rotations, const Context& context) {
  const ColumnRule rule(kSearchColumns);
  const std::vector<double> lengths = columnLengths(rule, polycube);
  const auto score = [&](const Mat3& axes) {
    return bestScale(columnLengths(rule, solid.table, axes), lengths).overlap;
  };
  const Positions positions = positionsOf(polycube);
  std::vector<Mat3> candidates;
  for (const Mat3& position : positions.distinct) {
    for (const Mat3& axes : candidateAxes(solid.shape, rotations)) candidates.push_back(axes * position);
  }
  return nearestToIdentity(bestAxes(candidates, score, context).front(), positions.same);
}

/// Of a fit along the mesh's axes and one along others.
PolycubeFit preferred(PolycubeFit along, PolycubeFit turned) {
  return turned.overlap > along.overlap + kClearGain ? std::move(turned) : std::move(along);
}

}  // namespace

void PolycubeOptions::validate() const {
  if (cells < 1 || cells > kMostCells)
    throw Error(Errc::usage, "polycube: the number of cells must lie in 1 to " + std::to_string(kMostCells));
  if (rotations < 0) throw Error(Errc::usage, "polycube: the number of rotations must not be negative");
  if (overlap && !(*overlap > 0 && *overlap < 1))
    throw Error(Errc::usage, "polycube: the overlap asked for must lie between 0 and 1");
  if (!rotation) return;
  constexpr double kRounding = 1e-9;
  if (!((rotation->transpose() * *rotation - Mat3::Identity()).norm() < kRounding &&
        rotation->determinant() > 0))
    throw Error(Errc::usage,
                "polycube: the axes are no rotation; give three unit vectors at right angles, "
                "right-handed");
}

PolycubeFit fitPolycube(const StarShape& shape, const PolycubeOptions& options, Context& context) {
  options.validate();
  if (options.cells == 1) return placePolycube(shape, cubeDomain(), options, context);
  context.progress("fitting a polycube", 0);
  const Solid solid(shape, context);
  const LatticeFitter fitter(options.cells, columnsFor(options.cells));
  PolycubeFit fit = closestFit(solid, options.rotation.value_or(Mat3::Identity()), fitter);
  if (!options.rotation)
    fit = preferred(std::move(fit), closestFit(solid, searchedAxes(solid, options, fitter, context), fitter));
  if (options.overlap) {
    std::vector<std::optional<PolycubeFit>> simple(static_cast<std::size_t>(options.cells));
    parallelChunks(simple.size(), 1, context, [&](std::size_t begin, std::size_t) {
      simple[begin] = simpleFit(solid, fit.axes, static_cast<int>(begin) + 1, *options.overlap);
    });
    if (auto best = fewestCorners(std::move(simple))) {
      fit = std::move(*best);
    } else {
      context.log(LogLevel::warning, "polycube: none of up to " + std::to_string(options.cells) +
                                         " cells a side overlaps the solid by " +
                                         std::to_string(*options.overlap) + "; the best does by " +
                                         std::to_string(fit.overlap));
    }
  }
  context.progress("fitting a polycube", 1);
  return fit;
}

PolycubeFit placePolycube(const StarShape& shape, const Polycube& polycube, const PolycubeOptions& options,
                          Context& context) {
  options.validate();
  context.progress("placing a polycube", 0);
  const Solid solid(shape, context);
  PolycubeFit fit = bestSize(solid, polycube, options.rotation.value_or(Mat3::Identity()));
  if (!options.rotation) {
    const Mat3 axes = searchedAxes(solid, polycube, options.rotations, context);
    fit = preferred(std::move(fit), bestSize(solid, polycube, axes));
  }
  context.progress("placing a polycube", 1);
  return fit;
}

}  // namespace polestar
