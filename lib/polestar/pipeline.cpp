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

#include "polestar/core/version.h"

namespace polestar {
namespace {

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

// Points of the solid's grid -> the ball, and G; as BallMap::sample.
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

}  // namespace

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

// The deep inverted cells, each as the box of its corners, grown by `margin`; boxes that meet become one.
std::vector<IndexBox> boxesOfInvertedCells(const SolidGrids& grids, int margin, std::size_t most,
                                           std::size_t& count) {
  constexpr int n = SolidGrids::Brick::kSize;
  std::vector<std::vector<IndexBox>> found(grids.leafCount("rest"));
  grids.visitBricks("rest", [&](std::size_t leaf, const SolidGrids::Brick& brick) {
    const VoxelBlock block{n, brick.values, brick.signedDistance, brick.active, grids.voxelSize()};
    if (judgeCells(block).invertedDeep == 0) return;
    for (const std::array<int, 3>& cell : deepInvertedCells(block)) {
      IndexBox box{};
      for (int a = 0; a < 3; ++a) {
        box.low[a] = brick.origin[a] + cell[a] - margin;
        box.high[a] = brick.origin[a] + cell[a] + 1 + margin;
      }
      found[leaf].push_back(box);
    }
  });
  std::vector<IndexBox> boxes;
  for (const auto& part : found) boxes.insert(boxes.end(), part.begin(), part.end());
  count = boxes.size();
  if (count > most) return {};
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
  return boxes;
}

}  // namespace

FilteredGrids filterCells(SolidGrids& grids, Context& context) {
  constexpr int kMargin = 8, kLargest = 160;
  constexpr double kMost = 1e-3;
  FilteredGrids result;
  const auto most = static_cast<std::size_t>(kMost * static_cast<double>(grids.insideVoxels()));
  for (const IndexBox& box : boxesOfInvertedCells(grids, kMargin, most, result.invertedBefore)) {
    context.throwIfCancelled();
    int size = 0;
    for (int a = 0; a < 3; ++a) size = std::max(size, box.high[a] - box.low[a] + 1);
    if (size > kLargest) continue;
    SolidGrids::Cube cube = grids.readCube("rest", box.low, size);
    FilteredBlock filtered =
        filterInvertedCells({size, cube.values, cube.signedDistance, cube.active, grids.voxelSize()});
    cube.values = std::move(filtered.rest);
    grids.replace("rest", cube, filtered.moved);
    result.voxels += filtered.moved.size();
    result.largestMove = std::max(result.largestMove, filtered.largestMove);
  }
  if (result.voxels > 0) {
    char move[16];
    std::snprintf(move, sizeof move, "%.2g", result.largestMove);
    context.log(LogLevel::warning,
                "the map turns faster than these voxels hold: " + std::to_string(result.invertedBefore) +
                    " cells between them were inverted; " + std::to_string(result.voxels) +
                    " voxels of rest around were low-pass filtered, moved by at most " + move +
                    " of the ball's radius");
  }
  grids.setMetadata("polestar:filtered_voxels", static_cast<std::int64_t>(result.voxels));
  return result;
}

CellQuality judgeVoxelCells(const SolidGrids& grids) {
  std::vector<CellQuality> quality(grids.leafCount("rest"));
  grids.visitBricks("rest", [&](std::size_t leaf, const SolidGrids::Brick& brick) {
    quality[leaf] = judgeCells(
        {SolidGrids::Brick::kSize, brick.values, brick.signedDistance, brick.active, grids.voxelSize()});
  });
  CellQuality total;
  for (const CellQuality& part : quality) total += part;
  return total;
}

Certificate certifyGrids(const BallMap& map, const SolidGrids& grids, std::size_t roundTrips,
                         Context& context) {
  // Every leaf fills its own slot, so that the result does not depend on who visits when.
  const std::size_t leaves = grids.leafCount("rest");
  std::vector<std::vector<Vec3>> inside(leaves);
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
  const std::size_t count = std::min(roundTrips, voxels.size());
  std::vector<Vec3> chosen(count);
  for (std::size_t i = 0; i < count; ++i) chosen[i] = voxels[i * voxels.size() / count];
  context.throwIfCancelled();
  context.progress("round trips", 0);
  const RoundTrip trip = measureRoundTrip(map, chosen);
  return certify(map, judgeVoxelCells(grids), trip, grids.voxelSize(), context);
}

}  // namespace polestar
