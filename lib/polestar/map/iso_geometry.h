#pragma once
// The parameters of a solid made visible: surfaces of constant ball radius, which are isopotentials of
// Green's function, radial lines, which are its field lines, and longitudes and latitudes. [Xia 2010, fig. 1]

#include <vector>

#include "polestar/core/context.h"
#include "polestar/map/ball_map.h"
#include "polestar/map/domain_curves.h"
#include "polestar/mesh/poly_data.h"

namespace polestar {

struct IsoOptions {
  std::vector<double> levels = {};  ///< ball radii of iso-surfaces, in (0, 1]
  int lines = 0;                    ///< field lines, spread evenly over the ball's directions
  double graticule = 0;             ///< degrees between longitudes and latitudes on every level; 0: none
  int sheets = 0;                   ///< half-planes of constant longitude, as pieces of surface
  double tolerance = 5e-4;          ///< of curves, share of the solid's box diagonal, > 0

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Unit vectors that are spread evenly, the same for the same number: points of a golden spiral around z.
std::vector<Vec3> evenDirections(std::size_t count);

/// The iso-surface s = `level` of the ball radius: the surface's own triangles, pulled inward along the radii
/// of the ball to the level and through the map's inverse. Closed; mesh units. At 1 the surface itself.
TriMesh levelSurface(const BallMap& map, double level);

/// The points of ball radius `level` along `directions`, mesh units.
std::vector<Vec3> pointsOfLevel(const VolumeMap& map, std::span<const Vec3> directions, double level);

/// Curves from the iso-surface `from` (0: the center) to the surface along `directions` of the ball, mesh
/// units. Outside the map's core these are field lines of Green's function. `tolerance`: see CurveOptions.
std::vector<SolidCurve> radialLines(const VolumeMap& map, std::span<const Vec3> directions, double from,
                                    double tolerance, Context& context = Context::quiet());

/// All that the options name, a part each: `level_S` for the iso-surface of ball radius S, `graticule_S` for
/// the curves on it, `field_lines`, `sheet_K`. Point data: `radius` (of the ball), `green` (1 / mesh units),
/// `ball` (coordinates, three components) and `arc` (length along a curve from its first point, mesh units; 0
/// on surfaces). The center's `green` is that of the innermost other point, as infinity is no number to draw.
PolyData isoGeometry(const BallMap& map, const IsoOptions& options, Context& context = Context::quiet());

}  // namespace polestar
