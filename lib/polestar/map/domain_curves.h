#pragma once
// What is simple in a map's domain, curves and pieces of surfaces, carried into the solid: straight lines of
// the ball become field lines, circles run on iso-surfaces. Sees nothing of a map but its inverse, so that
// any domain will do.

#include <functional>
#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/map/volume_map.h"

namespace polestar {

/// A curve in the domain: point(t), t in [0, 1]; called from one thread.
struct DomainCurve {
  std::function<Vec3(double)> point;
  int pieces = 8;  ///< looked at, at least; enough to see every bend once
};

/// Straight from corner to corner, at even speed along each piece. At least two corners.
DomainCurve domainPolyline(std::vector<Vec3> corners);

/// Points of a curve, in the domain and in the solid (mesh units).
struct SolidCurve {
  std::vector<Vec3> domain, solid;
};

struct CurveOptions {
  double tolerance = 0;  ///< between a curve and its chords, mesh units, > 0
  int deepest = 8;       ///< a piece is halved so often at most

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Curves as polylines whose chords are as near to them as the tolerance says, judged in the middle of each
/// piece. One batch of points a round over all curves; about two points of the map for one that stays.
/// @throws Error{Errc::io} when the map has no answer at a point, Error{Errc::cancelled}
std::vector<SolidCurve> traceCurves(const VolumeMap& map, std::span<const DomainCurve> curves,
                                    const CurveOptions& options, Context& context = Context::quiet());

/// A piece of surface in the domain: point(u, v), both in [0, 1].
struct DomainGrid {
  std::function<Vec3(double, double)> point;
  int columns = 1, rows = 1;  ///< quadrilaterals along u and v
};

/// Its (columns + 1) x (rows + 1) points, row by row, in the domain and in the solid.
SolidCurve traceGrid(const VolumeMap& map, const DomainGrid& grid);

/// Solid points of domain points. @throws Error{Errc::io} when the map has no answer at one.
std::vector<Vec3> pointsOfSolid(const VolumeMap& map, std::span<const Vec3> domain);

}  // namespace polestar
