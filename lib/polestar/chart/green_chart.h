#pragma once
// Field lines and the coordinates they give. [Xia 2010, sec. 4.1, step 4; traced inward, see docs/method.md]
//
// A field line enters the center with a direction omega; R falls along it from 1 to 0. (R, omega) are the
// canonical coordinates of the solid: they depend on the solid and its center alone.

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "polestar/chart/foliation.h"
#include "polestar/core/context.h"
#include "polestar/green/green_function.h"

namespace polestar {

struct ChartOptions {
  double tolerance = 1e-6;    ///< of the tracer, local error relative to the width of a flux tube
  double startDepth = 0.1;    ///< where a trace begins under its vertex, in units of the shortest edge there
  double innermost = 0.03;    ///< R of the last level, in (0, 0.25)
  double largestStep = 0.06;  ///< between levels of R
  /// 1 - R of the first level that all lines are traced to; 0: twenty times the boundary error's root mean
  /// square, within [0.01, 0.08]. Where the solid is narrow G falls exponentially and this level lies deep;
  /// levels nearer to 1 are added until the first layer is no thicker than the triangles above it.
  double firstStep = 0;

  void validate() const;  ///< @throws Error{Errc::usage}
};

struct ChartReport {
  std::size_t lines = 0;
  std::size_t deepened = 0;  ///< lines that needed a deeper start than asked
  std::size_t failed = 0;    ///< lines that no start could carry through; replaced by their neighbours' mean
  std::size_t retraced =
      0;                  ///< lines that were followed again from another start: cells around were inverted
  std::size_t added = 0;  ///< lines from midpoints of edges, where cells stayed inverted between the others
  std::size_t repaired = 0;  ///< lines that were replaced by their neighbours' mean for that reason
  std::size_t rayLines = 0;  ///< lines that were bent towards the rays of their vertices, as the last resort
  double largestMove = 0;    ///< of a node off its field line by repairs, inner units
  /// The same in the ball: from R omega of level and line to that of the new place.
  double largestMoveInBall = 0;
  std::size_t evaluations = 0;
  CellCounts cells;                ///< after repair
  std::size_t directionFlips = 0;  ///< triangles of the omega map that are not positively oriented (exact)
  double seconds = 0;
};

/// Follows field lines inward through a GreenFunction.
///
/// The variable is s = ln(rho G), which resolves both the center and narrow parts where G falls
/// exponentially; the unknown is y = x / R, which tends to rho * omega. Dormand-Prince 5(4), several lines in
/// step.
class FieldLineTracer {
 public:
  FieldLineTracer(GreenFunction green, double tolerance);

  struct Node {
    Vec3 position;  ///< inner frame
    double h;       ///< harmonic part of G there
    Vec3 gradient;  ///< of h
  };
  struct Line {
    bool ok = false;
    std::size_t firstLevel = 0;  ///< the first that lies below the start
    std::vector<Node> nodes;     ///< one a level from there
    double startRadius = 1;      ///< R of the start
    std::size_t evaluations = 0;
  };
  /// Traces from each start (inside, at its own G) to all `levels` of R, falling, that lie below the start's
  /// R.
  std::vector<Line> trace(std::span<const Vec3> starts, std::span<const double> levels) const;

 private:
  GreenFunction green_;
  double tolerance_;
};

/// Direction of the limit of x/|x| from the last two levels of a line, by Richardson extrapolation (error
/// O(R^4)).
Vec3 limitDirection(const Vec3& outer, double outerRadius, const Vec3& inner, double innerRadius);

/// Field lines of all vertices. Cheap to copy.
class GreenChart {
 public:
  struct Data {
    GreenFunction green;  ///< its shape may be a refinement of the one that was given
    Foliation foliation;
    std::vector<double> h;  ///< harmonic part of G at every node (0 <= id <= center)
    std::vector<Vec3>
        gradient;  ///< of h at every node; on the surface built from the boundary values and the density
    std::vector<Vec3> directions;  ///< omega of every vertex' line
    /// Nodes that repairs moved off their field lines, ids, ascending.
    std::vector<std::size_t> movedNodes;
    /// R omega at their new places, found by tracing from there; NaN where lines were bent towards rays: such
    /// a node still stands for its level and line, whatever the field says.
    std::vector<Vec3> movedCanonical;
    ChartReport report;
  };
  explicit GreenChart(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

  const GreenFunction& green() const { return data_->green; }
  const Foliation& foliation() const { return data_->foliation; }
  std::span<const double> harmonic() const { return data_->h; }
  std::span<const Vec3> harmonicGradient() const { return data_->gradient; }
  std::span<const Vec3> directions() const { return data_->directions; }
  std::span<const std::size_t> movedNodes() const { return data_->movedNodes; }
  std::span<const Vec3> movedCanonical() const { return data_->movedCanonical; }
  const ChartReport& report() const { return data_->report; }

 private:
  std::shared_ptr<const Data> data_;
};

/// Traces all vertices, refines the surface above cells that are inverted between true lines, repairs single
/// lines that were caught, counts the cells.
/// Cost: 100 to 200 evaluations of the field a vertex.
GreenChart traceChart(const GreenFunction& green, const ChartOptions& options = {},
                      Context& context = Context::quiet());

}  // namespace polestar
