#include "polestar/chart/green_chart.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <string>

#include "polestar/chart/detail/line_repair.h"
#include "polestar/chart/detail/line_tracing.h"
#include "polestar/chart/detail/local_refinement.h"
#include "polestar/chart/detail/ray_zone.h"
#include "polestar/chart/untangle.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/core/predicates.h"

namespace polestar {
namespace {

constexpr double kThinner = 3;         // between layers next to the surface
constexpr double kThinnest = 1e-7;     // 1 - R, below which G is noise
constexpr double kLargestShare = 0.2;  // of R, between levels
constexpr int kUntangleRings[] = {1, 2, 4, 8};
constexpr double kMostUntangled = 0.01;  // share of the cells; beyond it lines are noise and bend to rays

// 1 - R of the first level that all lines are traced to: thin layers at the surface, where R runs fastest
// through the cells; but thicker than the error of G on most of the surface. (Its maximum sits at a few
// creases, where lines are repaired.)
double firstStep(const ChartOptions& options, const BoundaryError& error) {
  return options.firstStep > 0 ? options.firstStep : std::clamp(20 * error.rms, 0.01, 0.08);
}

std::vector<double> chooseLevels(double first, const ChartOptions& options, std::vector<double> layer) {
  std::vector<double> levels{1};
  // In narrow parts even the first level lies deep. One vertex in two hundred may keep a thick layer.
  const auto thinnest = layer.begin() + static_cast<std::ptrdiff_t>(layer.size() / 200);
  std::nth_element(layer.begin(), thinnest, layer.end());
  std::vector<double> thin;
  for (double step = first / kThinner; step > std::max(kThinnest, *thinnest / kThinner); step /= kThinner)
    thin.push_back(step);
  for (auto step = thin.rbegin(); step != thin.rend(); ++step) levels.push_back(1 - *step);
  double step = first;
  double level = 1;
  while (level - step > 2 * options.innermost) {
    level -= step;
    levels.push_back(level);
    // In the core the map turns with ln R: levels must keep up.
    step = std::min({1.6 * step, options.largestStep, kLargestShare * level});
  }
  levels.push_back(options.innermost);
  return levels;
}

// Outward derivatives of G at the vertices. A layer's density is one, and jumps there; charges lie off the
// surface.
std::vector<double> surfaceSlopes(const GreenFunction& green,
                                  const std::vector<detail::VertexFrame>& frames) {
  const std::vector<Vec3>& vertices = green.shape().mesh().vertices;
  std::vector<double> slopes(vertices.size());
  if (const auto* layer = std::get_if<SurfaceLayer>(&green.sources())) {
    for (std::size_t i = 0; i < slopes.size(); ++i) slopes[i] = 4 * std::numbers::pi * layer->density[i];
    return slopes;
  }
  std::vector<double> value(vertices.size());
  std::vector<Vec3> gradient(vertices.size());
  green.evaluate(vertices, value, gradient);
  for (std::size_t i = 0; i < slopes.size(); ++i) slopes[i] = gradient[i].dot(frames[i].normal);
  return slopes;
}

// 1 - R as deep below each vertex as its triangles are wide.
std::vector<double> layerBelow(const detail::ChartSurface& surface, double harmonicRadius) {
  std::vector<double> layer(surface.frames.size());
  for (std::size_t i = 0; i < layer.size(); ++i)
    layer[i] = harmonicRadius * std::max(0.0, -surface.slopes[i]) * surface.frames[i].longestEdge;
  return layer;
}

// The inner nodes of some lines.
std::vector<std::size_t> nodesOfLines(const Foliation& f, const std::set<std::int32_t>& lines) {
  std::vector<std::size_t> ids;
  for (std::size_t level = 1; level < f.levels.size(); ++level) {
    for (const std::int32_t v : lines) ids.push_back(f.nodeId(level, static_cast<std::size_t>(v)));
  }
  return ids;
}

// R omega at the places of moved nodes, by the field lines through them.
void traceMovedNodes(GreenChart::Data& data, const std::set<std::size_t>& bent, double tolerance) {
  const Foliation& f = data.foliation;
  const FieldLineTracer tracer(data.green, tolerance);
  data.movedCanonical.assign(data.movedNodes.size(),
                             Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  detail::parallelChunks(data.movedNodes.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (bent.count(data.movedNodes[i])) continue;
      const Vec3& x = f.nodes[data.movedNodes[i]];
      double green;
      Vec3 gradient;
      data.green.evaluate({&x, 1}, {&green, 1}, {&gradient, 1});
      const double radius = data.green.ballRadius(green);
      const std::array<double, 2> levels{std::min(0.06, 0.7 * radius), std::min(0.03, 0.35 * radius)};
      const FieldLineTracer::Line line = tracer.trace({&x, 1}, levels).front();
      if (!(radius < 1) || !line.ok) continue;
      data.movedCanonical[i] =
          radius * limitDirection(line.nodes[0].position, levels[0], line.nodes[1].position, levels[1]);
    }
  });
  for (std::size_t i = 0; i < data.movedNodes.size(); ++i) {
    if (!data.movedCanonical[i].allFinite()) continue;
    const std::size_t level = data.movedNodes[i] / f.vertexCount, vertex = data.movedNodes[i] % f.vertexCount;
    data.report.largestMoveInBall =
        std::max(data.report.largestMoveInBall,
                 (data.movedCanonical[i] - f.levels[level] * data.directions[vertex]).norm());
  }
}

// Cells that are inverted or flat, mended by ever stronger means. Field lines stay what they are as far as
// another start or smaller triangles help. Returns the nodes that were bent towards rays.
std::set<std::size_t> makePositive(GreenChart::Data& data, detail::LineTracing& tracing,
                                   std::vector<std::int32_t> failed, const ChartOptions& options,
                                   Context& context) {
  Foliation& f = data.foliation;
  ChartReport& report = data.report;
  detail::fillLines(f, failed);
  const detail::RetracedLines again =
      detail::retraceLines(f, [&](const std::set<std::int32_t>& vertices, int attempt) {
        constexpr double kDepths[detail::kRetraces] = {4, 0.25, 10};  // of the first start's
        const std::vector<std::int32_t> lines(vertices.begin(), vertices.end());
        tracing.trace(lines, kDepths[attempt] * options.startDepth);
      });
  report.retraced = again.kept;
  detail::evaluateNodes(data, nodesOfLines(f, again.touched));

  const detail::LocalRefinement refined = detail::refineAboveBadCells(data, tracing, context);
  report.added = refined.vertices;
  failed.insert(failed.end(), refined.failed.begin(), refined.failed.end());
  report.failed = failed.size();

  const std::vector<Vec3> asTraced = f.nodes;
  const detail::ReplacedLines replaced = detail::replaceLines(f);
  const std::set<std::int32_t> lost(failed.begin(), failed.end());
  std::set<std::int32_t> lines = lost;
  for (const std::int32_t v : replaced.lines) report.repaired += lines.insert(v).second;
  const std::vector<std::size_t> nodesOfReplaced = nodesOfLines(f, lines);
  std::set<std::size_t> moved(nodesOfReplaced.begin(), nodesOfReplaced.end());

  std::size_t bad = replaced.badCells;
  for (const int rings : kUntangleRings) {
    if (bad == 0 || bad > kMostUntangled * static_cast<double>(f.cellCount())) break;
    context.progress("untangling cells", 0);
    const Untangling untangled = untangle(f, rings, context);
    moved.insert(untangled.movedNodes.begin(), untangled.movedNodes.end());
    bad = countCells(f).bad();
    context.log(LogLevel::debug, "untangling over " + std::to_string(rings) + " rings moved " +
                                     std::to_string(untangled.movedNodes.size()) + " nodes and left " +
                                     std::to_string(bad) + " bad cells");
  }
  std::set<std::size_t> bent;
  if (bad > 0) {
    const detail::RayZone zone = detail::bendTowardsRays(f, context);
    moved.insert(zone.movedNodes.begin(), zone.movedNodes.end());
    bent.insert(zone.movedNodes.begin(), zone.movedNodes.end());
    report.rayLines = zone.lines;
    context.log(
        LogLevel::warning,
        zone.everywhere
            ? "the foliation could not be untangled: rays from the center take the place of all field "
              "lines (the radial cone map; one to one, but not along the field)"
            : std::to_string(zone.lines) + " of " + std::to_string(f.vertexCount) +
                  " field lines were bent towards rays from the center, where cells could not be "
                  "untangled otherwise: the map is one to one there, but not along the field");
  }
  data.movedNodes.assign(moved.begin(), moved.end());
  for (const std::size_t id : data.movedNodes) {
    if (lost.count(static_cast<std::int32_t>(id % f.vertexCount))) continue;  // was nowhere before
    report.largestMove = std::max(report.largestMove, (f.nodes[id] - asTraced[id]).norm());
  }
  report.cells = countCells(f);
  return bent;
}

}  // namespace

void ChartOptions::validate() const {
  if (!(tolerance > 0 && tolerance < 0.1))
    throw Error(Errc::usage, "ChartOptions: tolerance must lie in (0, 0.1)");
  if (!(startDepth > 0)) throw Error(Errc::usage, "ChartOptions: startDepth must be positive");
  if (!(innermost > 0 && innermost < 0.25))
    throw Error(Errc::usage, "ChartOptions: innermost must lie in (0, 0.25)");
  if (!(largestStep > 0 && largestStep < 0.5))
    throw Error(Errc::usage, "ChartOptions: largestStep must lie in (0, 0.5)");
  if (!(firstStep >= 0 && firstStep < 0.5))
    throw Error(Errc::usage, "ChartOptions: firstStep must lie in [0, 0.5)");
}

GreenChart traceChart(const GreenFunction& green, const ChartOptions& options, Context& context) {
  options.validate();
  const auto startTime = std::chrono::steady_clock::now();
  const TriMesh& given = green.shape().mesh();
  auto data = std::make_shared<GreenChart::Data>(GreenChart::Data{green, {}, {}, {}, {}, {}, {}, {}});
  Foliation& foliation = data->foliation;
  foliation.vertexCount = given.vertices.size();
  foliation.triangles = given.triangles;
  detail::ChartSurface surface{detail::vertexFrames(given), {}};
  surface.slopes = surfaceSlopes(green, surface.frames);
  const double first = firstStep(options, green.boundaryError());
  foliation.levels = chooseLevels(first, options, layerBelow(surface, green.harmonicRadius()));
  foliation.nodes.assign(foliation.centerNode() + 1, Vec3::Zero());
  data->h.assign(foliation.nodes.size(), 0.0);
  data->gradient.assign(foliation.nodes.size(), Vec3::Zero());
  detail::evaluateNodes(*data, {foliation.centerNode()});

  detail::LineTracing tracing(*data, options, std::move(surface), 1 - first);
  std::vector<std::int32_t> all(foliation.vertexCount);
  std::iota(all.begin(), all.end(), 0);
  const std::vector<std::int32_t> failed = tracing.traceAll(std::move(all), context);
  const std::set<std::size_t> bent = makePositive(*data, tracing, failed, options, context);
  detail::evaluateNodes(*data, data->movedNodes);

  data->report.lines = foliation.vertexCount;
  const std::size_t last = foliation.layerCount();
  data->directions.resize(foliation.vertexCount);
  for (std::size_t i = 0; i < foliation.vertexCount; ++i) {
    data->directions[i] = limitDirection(foliation.node(last - 1, i), foliation.levels[last - 1],
                                         foliation.node(last, i), foliation.levels[last]);
  }
  for (const Triangle& t : foliation.triangles) {
    data->report.directionFlips +=
        orientDirections(data->directions[t[0]], data->directions[t[1]], data->directions[t[2]]) <= 0;
  }
  traceMovedNodes(*data, bent, options.tolerance);
  data->report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - startTime).count();
  return GreenChart(std::move(data));
}

}  // namespace polestar
