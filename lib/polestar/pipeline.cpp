#include "polestar/pipeline.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "polestar/certify/voxel_filter.h"
#include "polestar/certify/voxel_untangling.h"
#include "polestar/core/version.h"
#include "polestar/map/alignment.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/surface_points.h"
#include "polestar/mesh/shapes.h"
#include "polestar/polycube/domain_surface.h"
#include "polestar/polycube/polycube_text.h"

namespace polestar {
namespace {

// Of rho G on a polycube's surface. At reentrant corners the layer's density is so singular that splitting
// triangles gains a quarter a time; what is left sits in single vertices (the root mean square is 4e-4).
constexpr double kDomainTolerance = 5e-3;

// Adds the seconds that `work` takes to `total`.
template <class Work>
auto timed(double& total, Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  auto result = work();
  total += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

SphereMap firstSphereMap(const GreenChart& chart, SphereMapKind kind, Context& context) {
  const StarShape& shape = chart.green().shape();
  switch (kind) {
    case SphereMapKind::conformal:
      return conformalSphereMap(shape, {}, context);
    case SphereMapKind::fieldLine:
      return fieldLineSphereMap(shape, chart.directions(), context);
    case SphereMapKind::balanced:
      // Balancing starts from the directions of field lines, mostly the closest map without flips to its end.
      if (chart.report().directionFlips == 0) return fieldLineSphereMap(shape, chart.directions(), context);
      break;
    case SphereMapKind::radial:
      break;
  }
  return radialSphereMap(shape);
}

}  // namespace

BoundaryChoice chooseBoundary(const GreenChart& chart, const MapOptions& options, Context& context) {
  context.progress("mapping the boundary to the sphere", 0);
  SphereMap sphere = firstSphereMap(chart, options.boundary, context);
  const bool balanced = options.boundary == SphereMapKind::balanced;
  const RadiusKind kind = options.radius.value_or(balanced ? RadiusKind::balanced : RadiusKind::green);
  RadiusProfile radius;
  if (kind != RadiusKind::balanced) radius = radiusProfile(kind, chart.foliation());
  if (!balanced && kind != RadiusKind::balanced) return {std::move(sphere), std::move(radius)};

  BalanceOptions balance = options.balance;
  if (!balanced) balance.rounds = 0;
  BalancedMap result =
      balanceMap(chart, sphere, kind == RadiusKind::balanced ? nullptr : &radius, balance, context);
  if (balanced && !result.sphere.fallbackReason.empty())
    context.log(LogLevel::warning, result.sphere.fallbackReason);
  return {std::move(result.sphere), std::move(result.radius)};
}

BallMap mapToBall(const StarShape& given, const MapOptions& options, Context& context, MapTimings* timings) {
  // Charges take the vertices for all that is known of the surface: midpoints of chords would mislead them.
  const bool mayCut = options.largestAngle > 0 && options.green.solver == GreenSolver::layer;
  const StarShape shape = mayCut ? subdivide(given, options.largestAngle, context) : given;
  MapTimings ignored;
  MapTimings& seconds = timings ? *timings : ignored;
  const GreenFunction green = timed(seconds.green, [&] { return solveGreen(shape, options.green, context); });
  if (const double share = green.record().unresolvedArea; share > 0) {
    char percent[16];
    std::snprintf(percent, sizeof percent, "%.2g", 100 * share);
    context.log(LogLevel::warning, std::string("on ") + percent +
                                       " % of the surface double precision does not resolve Green's function "
                                       "(narrow parts far from the center): coordinates there are noise");
  }
  const GreenChart chart = timed(seconds.trace, [&] { return traceChart(green, options.chart, context); });
  BoundaryChoice boundary = timed(seconds.sphere, [&] { return chooseBoundary(chart, options, context); });
  BallMap map = timed(seconds.trace, [&] {
    return BallMap(chart, std::move(boundary.sphere), options.ball, std::move(boundary.radius));
  });
  if (!map.coreFallbackReason().empty()) context.log(LogLevel::warning, map.coreFallbackReason());
  return map;
}

namespace {

// As metadata and headers hold it.
std::string inOneLine(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ';');
  return text;
}

}  // namespace

DomainMap mapToDomain(const BallMap& solid, const PolycubeFit& fit, const MapOptions& options,
                      Context& context, MapTimings* timings) {
  // The center of the lattice is the origin of the domain's frame.
  StarOptions atOrigin;
  atOrigin.center = Vec3::Zero();
  atOrigin.rays = 0;
  const StarShape shape =
      verifyStarShape(verifyClosedSurface(domainSurface(fit.polycube)), atOrigin, context);
  MapOptions ofDomain = options;
  ofDomain.green.tolerance = std::max(options.green.tolerance, kDomainTolerance);
  BallMap domain = mapToBall(shape, ofDomain, context, timings);
  // Both charts are canonical where the boundary is `field-line`: where two solids are alike, so are their
  // potentials and field lines, and all that is left between the balls is how the axes lie.
  std::shared_ptr<const VolumeMap> motion;
  if (domain.sphere().kind == SphereMapKind::fieldLine && solid.sphere().kind == SphereMapKind::fieldLine) {
    motion = std::make_shared<BallMotion>(Mat3(fit.axes.transpose()));
  } else {
    motion = alignedMotion(solid, domain, fit.axes.transpose(), {}, context).motion;
  }
  const bool isCube = fit.polycube.cells().size() == 1;
  return {solid, std::move(motion), std::move(domain),
          DomainShape{isCube ? "cube" : "polycube", inOneLine(toText(fit.polycube)), fit.polycube.cellSide(),
                      fit.axes, fit.unit, fit.overlap}};
}

namespace {

// Points of the solid's grid -> the domain, and G; as BallMap::sample.
using Sampler = std::function<void(std::span<const Vec3>, std::span<Vec3>, std::span<double>)>;

SolidGrids sampledGrids(const BallMap& map, const Sampler& sample, const GridOptions& options,
                        Context& context) {
  const GreenFunction& green = map.chart().green();
  const StarShape& shape = green.shape();
  SolidGrids grids(shape.surface().mesh(), options, context);
  const double radius = green.harmonicRadius() * shape.frame().unit;
  const double cap = 1 / options.voxelSize;
  const std::array<Attribute, 2> attributes{{{.name = "rest", .vector = true}, {.name = "green"}}};
  grids.add(
      attributes,
      [&](const VoxelBatch& batch, AttributeValues& out) {
        const std::span<Vec3f> rest = out.vectors(0);
        const std::span<float> values = out.scalars(1);
        std::vector<Vec3> ball(batch.points.size());
        std::vector<double> value(batch.points.size());
        sample(batch.points, ball, value);
        for (std::size_t i = 0; i < ball.size(); ++i) {
          rest[i] = ball[i].cast<float>();
          values[i] = static_cast<float>(std::min(value[i], cap));
        }
      },
      true, context);

  grids.setMetadata("polestar:version", std::string(kVersion));
  grids.setMetadata("polestar:domain", std::string("ball"));
  grids.setMetadata("polestar:center", shape.frame().origin);
  grids.setMetadata("polestar:harmonic_radius", radius);
  grids.setMetadata("polestar:green_cap", cap);
  grids.setMetadata("polestar:core",
                    std::string(map.options().core == CoreMode::smooth ? "smooth" : "paper"));
  grids.setMetadata("polestar:core_radius",
                    map.options().core == CoreMode::smooth ? map.options().coreRadius : 0.0);
  grids.setMetadata("polestar:boundary", std::string(toString(map.sphere().kind)));
  grids.setMetadata("polestar:radius", std::string(toString(map.radius().kind())));
  grids.setMetadata("polestar:boundary_error", green.boundaryError().max);
  return grids;
}

// Of grids that are in a domain's coordinates, or hold them.
void setDomainMetadata(const DomainShape& shape, SolidGrids& grids) {
  grids.setMetadata("polestar:domain", shape.kind);
  grids.setMetadata("polestar:domain_cells", shape.cells);
  grids.setMetadata("polestar:domain_cell_side", shape.cellSide);
  for (int k = 0; k < 3; ++k)
    grids.setMetadata(std::string("polestar:domain_axis_") + "xyz"[k], Vec3(shape.axes.col(k)));
  grids.setMetadata("polestar:domain_unit", shape.unit);
  grids.setMetadata("polestar:domain_overlap", shape.overlap);
}

SolidGrids positionGrids(const TriMesh& domain,
                         const std::function<void(std::span<const Vec3>, std::span<Vec3>)>& inverse,
                         const GridOptions& options, Context& context) {
  SolidGrids grids(domain, options, context);
  grids.addVector(
      "position", ValueRole::invariant,
      [&](const VoxelBatch& batch, std::span<Vec3f> values) {
        std::vector<Vec3> solid(batch.points.size());
        inverse(batch.points, solid);
        for (std::size_t i = 0; i < solid.size(); ++i) values[i] = solid[i].cast<float>();
      },
      true, context);
  grids.setMetadata("polestar:version", std::string(kVersion));
  grids.setMetadata("polestar:domain", std::string("ball"));
  return grids;
}

}  // namespace

SolidGrids gridsOf(const DomainMap& map, const GridOptions& options, Context& context) {
  SolidGrids grids = sampledGrids(
      map.solid(),
      [&](std::span<const Vec3> solid, std::span<Vec3> domain, std::span<double> green) {
        map.sample(solid, domain, green);
      },
      options, context);
  setDomainMetadata(map.shape(), grids);
  grids.setMetadata("polestar:exact", std::string("no"));
  return grids;
}

SolidGrids inverseGridsOf(const BallMap& map, const GridOptions& options, Context& context) {
  // The grids' surface is 1 - cos of half an edge below the sphere, 8e-5.
  const SurfacePoints surface(map);
  return positionGrids(
      icosphere(6),
      [&](std::span<const Vec3> ball, std::span<Vec3> solid) { surface.continuedInverse(ball, solid); },
      options, context);
}

SolidGrids inverseGridsOf(const DomainMap& map, const GridOptions& options, Context& context) {
  SolidGrids grids = positionGrids(
      map.domain().chart().green().shape().surface().mesh(),
      [&](std::span<const Vec3> domain, std::span<Vec3> solid) { map.sampleInverse(domain, solid); }, options,
      context);
  setDomainMetadata(map.shape(), grids);
  return grids;
}

SolidGrids gridsOf(const BallMap& map, const GridOptions& options, Context& context) {
  SolidGrids grids = sampledGrids(
      map,
      [&](std::span<const Vec3> solid, std::span<Vec3> ball, std::span<double> green) {
        map.sample(solid, ball, green);
      },
      options, context);
  grids.setMetadata("polestar:exact", std::string("no"));
  return grids;
}

TracedGrids tracedGridsOf(const BallMap& map, const GridOptions& options, Context& context) {
  const TracedBallMap traced(map);
  std::atomic<std::size_t> failed = 0;
  SolidGrids grids = sampledGrids(
      map,
      [&](std::span<const Vec3> solid, std::span<Vec3> ball, std::span<double> green) {
        failed += traced.sample(solid, ball, green);
      },
      options, context);
  grids.setMetadata("polestar:exact", std::string("yes"));
  grids.setMetadata("polestar:answered_by_table", static_cast<std::int64_t>(failed));
  return {std::move(grids), failed};
}

namespace {

// Index coordinates, both ends included.
struct IndexBox {
  std::array<int, 3> low, high;

  bool near(const IndexBox& other) const {
    for (int a = 0; a < 3; ++a) {
      if (low[a] > other.high[a] || other.low[a] > high[a]) return false;
    }
    return true;
  }
  void include(const IndexBox& other) {
    for (int a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], other.low[a]);
      high[a] = std::max(high[a], other.high[a]);
    }
  }
};

// The deep inverted cells of a leaf, each as the box of its corners, grown by `margin`.
std::vector<IndexBox> boxesOf(const VoxelBlock& block, const SolidGrids::Brick& brick, int margin) {
  std::vector<IndexBox> boxes;
  for (const std::array<int, 3>& cell : deepInvertedCells(block)) {
    IndexBox box{};
    for (int a = 0; a < 3; ++a) {
      box.low[a] = brick.origin[a] + cell[a] - margin;
      box.high[a] = brick.origin[a] + cell[a] + 1 + margin;
    }
    boxes.push_back(box);
  }
  return boxes;
}

// Boxes that meet become one.
void mergeBoxes(std::vector<IndexBox>& boxes) {
  for (bool merged = true; merged;) {
    merged = false;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t j = boxes.size(); j-- > i + 1;) {
        if (!boxes[i].near(boxes[j])) continue;
        boxes[i].include(boxes[j]);
        boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(j));
        merged = true;
      }
    }
  }
}

// Every leaf fills its own slot, so that the result does not depend on who visits when.
CellQuality judgeLeaves(
    const SolidGrids& grids, const std::string& vectorGrid,
    const std::function<void(std::size_t, const VoxelBlock&, const SolidGrids::Brick&)>& ofLeafWithInverted) {
  std::vector<CellQuality> quality(grids.leafCount(vectorGrid));
  grids.visitBricks(vectorGrid, [&](std::size_t leaf, const SolidGrids::Brick& brick) {
    const VoxelBlock block{SolidGrids::Brick::kSize, brick.values, brick.signedDistance, brick.active,
                           grids.voxelSize()};
    quality[leaf] = judgeCells(block);
    if (quality[leaf].invertedDeep > 0 && ofLeafWithInverted) ofLeafWithInverted(leaf, block, brick);
  });
  CellQuality total;
  for (const CellQuality& part : quality) total += part;
  return total;
}

std::vector<char> outsideOf(const DomainMap& map, std::span<const Vec3> places) {
  std::vector<Vec3> ball(places.size());
  std::vector<double> green(places.size());
  map.domain().sample(places, ball, green);
  std::vector<char> outside(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) outside[i] = !(ball[i].norm() <= 1);
  return outside;
}

}  // namespace

MendedVoxels mendVoxels(SolidGrids& grids, const DomainMap* domain, Context& context) {
  constexpr int kMargin = 8, kLargest = 160;
  constexpr double kMost = 1e-3;
  std::vector<std::vector<IndexBox>> found(grids.leafCount("rest"));
  MendedVoxels result;
  result.cells = judgeLeaves(grids, "rest",
                             [&](std::size_t leaf, const VoxelBlock& block, const SolidGrids::Brick& brick) {
                               found[leaf] = boxesOf(block, brick, kMargin);
                             });
  std::vector<IndexBox> boxes;
  for (const auto& part : found) boxes.insert(boxes.end(), part.begin(), part.end());
  result.invertedBefore = boxes.size();
  if (static_cast<double>(boxes.size()) > kMost * static_cast<double>(grids.insideVoxels())) boxes.clear();
  mergeBoxes(boxes);
  for (const IndexBox& box : boxes) {
    context.throwIfCancelled();
    int size = 0;
    for (int a = 0; a < 3; ++a) size = std::max(size, box.high[a] - box.low[a] + 1);
    if (size > kLargest) continue;
    SolidGrids::Cube cube = grids.readCube("rest", box.low, size);
    const VoxelBlock block{size, cube.values, cube.signedDistance, cube.active, grids.voxelSize()};
    MendedBlock mended =
        domain ? untangleInvertedCells(
                     block, [&](std::span<const Vec3> places) { return outsideOf(*domain, places); }, context)
               : filterInvertedCells(block);
    cube.values = std::move(mended.rest);
    grids.replace("rest", cube, mended.moved);
    result.voxels += mended.moved.size();
    result.largestMove = std::max(result.largestMove, mended.largestMove);
  }
  if (result.voxels > 0) {
    result.cells = judgeVoxelCells(grids);
    char move[16];
    std::snprintf(move, sizeof move, "%.2g", result.largestMove);
    context.log(LogLevel::warning,
                "the map turns faster than these voxels hold: " + std::to_string(result.invertedBefore) +
                    " cells between them were inverted; " + std::to_string(result.voxels) +
                    " voxels of rest around were " + (domain ? "untangled" : "low-pass filtered") +
                    ", moved by at most " + move +
                    (domain ? " of half the domain's length" : " of the ball's radius"));
  }
  grids.setMetadata("polestar:filtered_voxels", static_cast<std::int64_t>(result.voxels));
  return result;
}

CellQuality judgeVoxelCells(const SolidGrids& grids, const std::string& vectorGrid) {
  return judgeLeaves(grids, vectorGrid, {});
}

namespace {

// Up to `most` of the voxels inside, spread evenly; mesh units.
std::vector<Vec3> someInside(const SolidGrids& grids, std::size_t most) {
  std::vector<std::vector<Vec3>> inside(grids.leafCount("rest"));
  grids.visitBricks("rest", [&](std::size_t leaf, const SolidGrids::Brick& brick) {
    constexpr int n = SolidGrids::Brick::kSize;
    for (int i = 0; i + 1 < n; ++i) {
      for (int j = 0; j + 1 < n; ++j) {
        for (int k = 0; k + 1 < n; ++k) {
          const int at = (i * n + j) * n + k;
          if (brick.active[at] && brick.signedDistance[at] < 0) {
            inside[leaf].push_back(
                grids.indexToWorld(Vec3(brick.origin[0] + i, brick.origin[1] + j, brick.origin[2] + k)));
          }
        }
      }
    }
  });
  std::vector<Vec3> voxels;
  for (const std::vector<Vec3>& part : inside) voxels.insert(voxels.end(), part.begin(), part.end());
  const std::size_t count = std::min(most, voxels.size());
  std::vector<Vec3> chosen(count);
  for (std::size_t i = 0; i < count; ++i) chosen[i] = voxels[i * voxels.size() / count];
  return chosen;
}

template <class Map>
Certificate certifyGridsOf(const Map& map, const SolidGrids& grids, std::size_t roundTrips,
                           Context& context) {
  const std::vector<Vec3> chosen = someInside(grids, roundTrips);
  context.throwIfCancelled();
  context.progress("round trips", 0);
  const RoundTrip trip = measureRoundTrip(map, chosen);
  return certify(map, judgeVoxelCells(grids), trip, grids.voxelSize(), context);
}

}  // namespace

Certificate certifyGrids(const BallMap& map, const SolidGrids& grids, std::size_t roundTrips,
                         Context& context) {
  return certifyGridsOf(map, grids, roundTrips, context);
}

Certificate certifyGrids(const DomainMap& map, const SolidGrids& grids, std::size_t roundTrips,
                         Context& context) {
  return certifyGridsOf(map, grids, roundTrips, context);
}

}  // namespace polestar
