#pragma once
// Start reading here. A star-shaped solid becomes coordinates; this is the road, one function a stage. Each
// takes what only the stage before it can make, so that a value in your hands is a proof that its stage
// succeeded.
//
//   file -> TriMesh -> ClosedSurface -> StarShape -> GreenFunction -> GreenChart -> BallMap -> grids,
//   pictures
//                                           \---------> SphereMap ------------------/
//                                            \--------> Polycube, one more StarShape: DomainMap
//
// Two of the sphere maps, `field-line` and `balanced`, and all radii but `green` are read off the chart.

#include <optional>

#include "polestar/certify/certificate.h"
#include "polestar/certify/voxel_cells.h"
#include "polestar/chart/green_chart.h"
#include "polestar/green/green_function.h"
#include "polestar/map/balanced.h"
#include "polestar/map/ball_map.h"
#include "polestar/map/domain_map.h"
#include "polestar/map/map_file.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/repair.h"
#include "polestar/polycube/fit_polycube.h"
#include "polestar/sphere/sphere_map.h"
#include "polestar/star/star_shape.h"
#include "polestar/star/subdivide.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {

// clang-format off
//  MeshFile       readMesh(path)              mesh/    doubles as the file has them
//  RepairedMesh   repairMesh(mesh)            mesh/    welded, oriented, every change counted
//  ClosedSurface  verifyClosedSurface(mesh)   mesh/    one closed surface of genus 0, or where not
//  StarShape      verifyStarShape(surface)    star/    a center, by exact predicates
//  StarShape      subdivide(shape, angle)     star/    triangles that a table can be built on
//  GreenFunction  solveGreen(shape)           green/   G = 1/r + h, and how far it is from 0 on S
//  GreenChart     traceChart(green)           chart/   field lines: the table of (R, omega)
//  SphereMap      conformalSphereMap(shape)   sphere/  phi, without a flip
//  BallMap        BallMap(chart, sphere)      map/     forward, inverse, Jacobian
//  PolycubeFit    fitPolycube(shape)          polycube/  a domain that resembles the solid
//  DomainMap      mapToDomain(ball, fit)      map/     the same three, onto that
// clang-format on

struct MapOptions {
  SphereMapKind boundary = SphereMapKind::conformal;
  /// Nothing: green, or balanced with the balanced boundary.
  std::optional<RadiusKind> radius;
  GreenOptions green;
  ChartOptions chart;
  BalanceOptions balance;
  BallMapOptions ball;
  /// Triangles wider than this, in radians seen from the center, are cut before anything else: the table's
  /// error between lines falls with the third power of their distance. 0: never. The solver `mfs` gets the
  /// mesh as it is.
  double largestAngle = 0.12;
};

/// Seconds of each stage.
struct MapTimings {
  double green = 0, trace = 0, sphere = 0;
};

/// From a verified shape to its map. @throws what the stages throw.
BallMap mapToBall(const StarShape& shape, const MapOptions& options = {}, Context& context = Context::quiet(),
                  MapTimings* timings = nullptr);

/// From a solid's ball map to its coordinates in a polycube, which is mapped by the same options. Where both
/// have the boundary `field-line`, points with the same potential on the same field line belong together,
/// after the turn of the axes: the least distortion by far, and no kinks inside. With another boundary the
/// two balls are brought into line so that points of the surfaces which are seen from the center in one
/// direction meet as nearly as motions let them. [docs/method.md, "Cubes and polycubes", with what was
/// measured] `timings`: of the polycube.
/// @throws what mapToBall() throws.
DomainMap mapToDomain(const BallMap& solid, const PolycubeFit& fit, const MapOptions& options = {},
                      Context& context = Context::quiet(), MapTimings* timings = nullptr);

/// The two freedoms of the ball map, as `options.boundary` and `options.radius` choose them.
struct BoundaryChoice {
  SphereMap sphere;
  RadiusProfile radius;
};
/// What mapToBall() puts into its BallMap. @throws what the sphere maps throw.
BoundaryChoice chooseBoundary(const GreenChart& chart, const MapOptions& options = {},
                              Context& context = Context::quiet());

/// The grids `surface`, `density`, `rest` and `green` of a map, with its provenance as metadata. G is capped
/// at the value it has at one voxel from the center; the cap is in the metadata.
SolidGrids gridsOf(const BallMap& map, const GridOptions& options, Context& context = Context::quiet());
/// `rest` in the domain's coordinates; the domain is in the metadata.
SolidGrids gridsOf(const DomainMap& map, const GridOptions& options, Context& context = Context::quiet());

/// The other way round, for looking up by coordinates: the domain's `surface` and `density`, and `position`,
/// the point of the solid in mesh units. `options` are in the domain's units.
SolidGrids inverseGridsOf(const BallMap& map, const GridOptions& options,
                          Context& context = Context::quiet());
SolidGrids inverseGridsOf(const DomainMap& map, const GridOptions& options,
                          Context& context = Context::quiet());

/// The same with a field line traced from every voxel inside, where gridsOf() reads the map's table.
struct TracedGrids {
  SolidGrids grids;
  std::size_t answeredByTable = 0;  ///< voxels inside whose trace failed
};
/// 30 to 60 us of processor time a voxel inside, about ten times what gridsOf() takes.
TracedGrids tracedGridsOf(const BallMap& map, const GridOptions& options,
                          Context& context = Context::quiet());

/// What mendVoxels() changed.
struct MendedVoxels {
  std::size_t voxels = 0;          ///< of `rest` that moved
  std::size_t invertedBefore = 0;  ///< cells deeper than one voxel
  double largestMove = 0;          ///< in ball radii; in domain units of another domain
  CellQuality cells;               ///< judgeVoxelCells() of what the grids hold now
};
/// Moves samples of `rest` around the cells deeper than a voxel that came out inverted, where these are few
/// (up to one in a thousand cells): by a low-pass filter in the ball (certify/voxel_filter.h), by untangling
/// in other domains (certify/voxel_untangling.h). Counted in the metadata.
/// `domain`: the map that `rest` was made from, where that is no ball map.
MendedVoxels mendVoxels(SolidGrids& grids, const DomainMap* domain = nullptr,
                        Context& context = Context::quiet());

/// Judges the cells of a grid as written: `rest`, or `position`.
CellQuality judgeVoxelCells(const SolidGrids& grids, const std::string& vectorGrid = "rest");

/// judgeVoxelCells() of `rest`, and the round trip through up to `roundTrips` of its voxels.
Certificate certifyGrids(const BallMap& map, const SolidGrids& grids, std::size_t roundTrips = 50000,
                         Context& context = Context::quiet());
/// The domain's map is judged as the solid's is; those checks have names that begin with `domain_`.
Certificate certifyGrids(const DomainMap& map, const SolidGrids& grids, std::size_t roundTrips = 50000,
                         Context& context = Context::quiet());

}  // namespace polestar
