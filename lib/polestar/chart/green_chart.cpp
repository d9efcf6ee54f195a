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
#include "polestar/chart/detail/ray_zone.h"
#include "polestar/chart/detail/untangle.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/core/predicates.h"

namespace polestar {
namespace {

constexpr int kAttempts = 10;  // at deeper and deeper starts
constexpr double kDeeper = 1.6, kShallower = 0.6;
constexpr double kThinner = 3;         // between layers next to the surface
constexpr double kThinnest = 1e-7;     // 1 - R, below which G is noise
constexpr double kLargestShare = 0.2;  // of R, between levels
constexpr std::size_t kBatch = 256;    // lines between two looks at cancellation
constexpr int kUntangleRings[] = {1, 2, 4, 8};
constexpr double kMostUntangled = 0.01;  // share of the cells; beyond it lines are noise and bend to rays

// 1 - R of the first level that all lines are traced to: thin layers at the surface, where R runs fastest
// through the cells; but thicker than the error of G on most of the surface. (Its maximum sits at a few
// creases, where lines are repaired.)
double firstStep(const ChartOptions& options, const BoundaryError& error) {
  return options.firstStep > 0 ? options.firstStep : std::clamp(20 * error.rms, 0.01, 0.08);
}

// `layer`: 1 - R as deep below each vertex as its triangles are wide.
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

// What a vertex knows of its neighbourhood.
struct VertexFrame {
  Vec3 normal = Vec3::Zero();  // angle-weighted, outward, unit
  double shortestEdge = 1e300, longestEdge = 0;
};

std::vector<VertexFrame> vertexFrames(const TriMesh& mesh) {
  std::vector<VertexFrame> frames(mesh.vertices.size());
  const std::vector<Vec3> normals = vertexNormals(mesh);
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].normal = normals[i];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      VertexFrame& frame = frames[mesh.triangles[t][k]];
      const double next = (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).norm(),
                   last = (mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k)).norm();
      frame.shortestEdge = std::min({frame.shortestEdge, next, last});
      frame.longestEdge = std::max({frame.longestEdge, next, last});
    }
  }
  return frames;
}

// Where the trace of a vertex begins: a little inside, along the field, above the first level.
class StartFinder {
 public:
  StartFinder(const GreenFunction& green, double firstLevel) : green_(green), firstLevel_(firstLevel) {}

  Vec3 find(const Vec3& vertex, const VertexFrame& frame, double depth) const {
    Vec3 start = vertex;
    for (int shorter = 0; shorter < 40; ++shorter, depth *= kShallower) {
      Vec3 direction = -frame.normal, gradient;
      double green;
      // The field at the start turns the way towards itself; close to a crease the normal alone would miss
      // the line.
      for (int turn = 0; turn < 3; ++turn) {
        evaluate(vertex + depth * direction, green, gradient);
        const Vec3 inward = gradient.normalized();
        if (!(inward.dot(frame.normal) < -0.05)) break;
        direction = (direction + inward).normalized();
      }
      start = vertex + depth * direction;
      evaluate(start, green, gradient);
      if (1 / (1 + green_.harmonicRadius() * green) > firstLevel_ + 0.2 * (1 - firstLevel_)) break;
    }
    return start;
  }

 private:
  void evaluate(const Vec3& x, double& green, Vec3& gradient) const {
    green_.evaluate({&x, 1}, {&green, 1}, {&gradient, 1});
  }
  const GreenFunction& green_;
  double firstLevel_;
};

// Follows the lines of chosen vertices into `data`.
class LineTracing {
 public:
  /// `firstTraced`: the level that every start lies above.
  LineTracing(GreenChart::Data& data, const ChartOptions& options, const std::vector<VertexFrame>& frames,
              double firstTraced)
      : data_(data),
        frames_(frames),
        levels_(std::span(data.foliation.levels).subspan(1)),
        finder_(data.green, firstTraced),
        tracer_(data.green, options.tolerance) {}

  /// From starts `depth` shortest edges below the vertices. Returns the vertices that failed; nothing of
  /// theirs is written.
  std::vector<std::int32_t> trace(std::span<const std::int32_t> vertices, double depth) {
    const std::vector<Vec3>& surface = data_.green.shape().mesh().vertices;
    std::vector<Vec3> starts(vertices.size());
    detail::parallelChunks(vertices.size(), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::int32_t v = vertices[i];
        starts[i] = finder_.find(surface[v], frames_[v], depth * frames_[v].shortestEdge);
      }
    });
    const std::vector<FieldLineTracer::Line> lines = tracer_.trace(starts, levels_);
    std::vector<std::int32_t> failed;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      data_.report.evaluations += lines[i].evaluations;
      if (!lines[i].ok) {
        failed.push_back(vertices[i]);
        continue;
      }
      store(vertices[i], starts[i], lines[i]);
    }
    return failed;
  }

 private:
  void store(std::int32_t vertex, const Vec3& start, const FieldLineTracer::Line& line) {
    const Foliation& f = data_.foliation;
    for (std::size_t k = line.firstLevel; k < levels_.size(); ++k) {
      const FieldLineTracer::Node& node = line.nodes[k - line.firstLevel];
      const std::size_t id = f.nodeId(k + 1, vertex);
      data_.foliation.nodes[id] = node.position;
      data_.h[id] = node.h;
      data_.gradient[id] = node.gradient;
    }
    if (line.firstLevel > 0) fillAbove(vertex, start, line);
  }

  // Levels between the surface, where R = 1, and the start: on the straight way, where R falls nearly evenly.
  void fillAbove(std::int32_t vertex, const Vec3& start, const FieldLineTracer::Line& line) {
    constexpr int kCorrections = 4;
    const Vec3 surface = data_.foliation.node(0, static_cast<std::size_t>(vertex));
    for (std::size_t k = 0; k < line.firstLevel; ++k) {
      const std::size_t id = data_.foliation.nodeId(k + 1, vertex);
      double share = (1 - levels_[k]) / (1 - line.startRadius);
      for (int correction = 0;; ++correction) {
        const Vec3 x = (1 - share) * surface + share * start;
        data_.foliation.nodes[id] = x;
        data_.green.field().evaluate({&x, 1}, {&data_.h[id], 1}, {&data_.gradient[id], 1});
        const double radius = data_.green.ballRadius(1 / x.norm() + data_.h[id]);
        const double better = share * (1 - levels_[k]) / (1 - radius);
        // The error of G next to the surface may exceed G: then the even way is all there is.
        if (std::abs(better / share - 1) < 0.02 || correction == kCorrections || !(better > 0.5 * share))
          break;
        share = std::min({better, 2 * share, 0.95});
      }
    }
  }

  GreenChart::Data& data_;
  const std::vector<VertexFrame>& frames_;
  std::span<const double> levels_;
  StartFinder finder_;
  FieldLineTracer tracer_;
};

// Every vertex, from deeper starts where a line fails. Returns the vertices that failed for good.
std::vector<std::int32_t> traceAll(LineTracing& tracing, ChartReport& report, const ChartOptions& options,
                                   std::size_t n, Context& context) {
  std::vector<std::int32_t> pending(n);
  std::iota(pending.begin(), pending.end(), 0);
  double depth = options.startDepth;
  for (int attempt = 0; attempt < kAttempts && !pending.empty(); ++attempt, depth *= kDeeper) {
    std::vector<std::int32_t> failed;
    for (std::size_t begin = 0; begin < pending.size(); begin += kBatch) {
      context.throwIfCancelled();
      if (attempt == 0) {
        context.progress("following field lines", static_cast<double>(begin) / static_cast<double>(n));
      }
      const auto batch = std::span(pending).subspan(begin, std::min(kBatch, pending.size() - begin));
      const std::vector<std::int32_t> lost = tracing.trace(batch, depth);
      if (attempt > 0) report.deepened += batch.size() - lost.size();
      failed.insert(failed.end(), lost.begin(), lost.end());
    }
    pending = std::move(failed);
  }
  return pending;
}

// Outward derivatives of G at the vertices. A layer's density is one, and jumps there; charges lie off the
// surface.
std::vector<double> surfaceSlopes(const GreenFunction& green, const std::vector<VertexFrame>& frames) {
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

// Values on the surface: G = 0 gives h and its tangential gradient, the slope of G the normal one.
void setSurfaceValues(GreenChart::Data& data, const std::vector<VertexFrame>& frames,
                      const std::vector<double>& slopes) {
  const TriMesh& mesh = data.green.shape().mesh();
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3& v = mesh.vertices[i];
    data.foliation.nodes[i] = v;
    data.h[i] = -1 / v.norm();
    data.gradient[i] = v / std::pow(v.norm(), 3) + slopes[i] * frames[i].normal;
  }
}

void evaluateNodes(GreenChart::Data& data, const std::vector<std::size_t>& ids) {
  std::vector<Vec3> points(ids.size()), gradient(ids.size());
  std::vector<double> h(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) points[i] = data.foliation.nodes[ids[i]];
  data.green.field().evaluate(points, h, gradient);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    data.h[ids[i]] = h[i];
    data.gradient[ids[i]] = gradient[i];
  }
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

// Cells that are inverted or flat, mended by ever stronger means. Returns the nodes that were bent towards
// rays.
std::set<std::size_t> makePositive(GreenChart::Data& data, LineTracing& tracing,
                                   std::span<const std::int32_t> failed, const ChartOptions& options,
                                   Context& context) {
  Foliation& f = data.foliation;
  ChartReport& report = data.report;
  const std::vector<Vec3> asTraced = f.nodes;
  const detail::LineRepair lines =
      detail::repairLines(f, failed, [&](const std::set<std::int32_t>& vertices, int attempt) {
        constexpr double kDepths[detail::kRetraces] = {4, 0.25, 10};  // of the first start's
        const std::vector<std::int32_t> again(vertices.begin(), vertices.end());
        tracing.trace(again, kDepths[attempt] * options.startDepth);
      });
  report.retraced = lines.retraced;
  report.repaired = lines.lines;
  std::set<std::size_t> moved(lines.movedNodes.begin(), lines.movedNodes.end());

  std::size_t bad = lines.badCells;
  for (const int rings : kUntangleRings) {
    if (bad == 0 || bad > kMostUntangled * static_cast<double>(f.cellCount())) break;
    context.progress("untangling cells", 0);
    const detail::Untangling untangled = detail::untangle(f, rings, context);
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
    if (asTraced[id] == Vec3::Zero()) continue;  // of a line that failed
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
  const TriMesh& mesh = green.shape().mesh();
  const std::size_t n = mesh.vertices.size();

  auto data = std::make_shared<GreenChart::Data>(GreenChart::Data{green, {}, {}, {}, {}, {}, {}, {}});
  Foliation& foliation = data->foliation;
  foliation.vertexCount = n;
  foliation.triangles = mesh.triangles;
  const std::vector<VertexFrame> frames = vertexFrames(mesh);
  const std::vector<double> slopes = surfaceSlopes(green, frames);
  std::vector<double> layer(n);
  for (std::size_t i = 0; i < n; ++i)
    layer[i] = green.harmonicRadius() * std::max(0.0, -slopes[i]) * frames[i].longestEdge;
  const double first = firstStep(options, green.boundaryError());
  foliation.levels = chooseLevels(first, options, std::move(layer));
  foliation.nodes.assign(foliation.centerNode() + 1, Vec3::Zero());
  data->h.assign(foliation.nodes.size(), 0.0);
  data->gradient.assign(foliation.nodes.size(), Vec3::Zero());

  setSurfaceValues(*data, frames, slopes);
  evaluateNodes(*data, {foliation.centerNode()});
  LineTracing tracing(*data, options, frames, 1 - first);
  const std::vector<std::int32_t> failed = traceAll(tracing, data->report, options, n, context);
  data->report.lines = n;
  data->report.failed = failed.size();
  const std::set<std::size_t> bent = makePositive(*data, tracing, failed, options, context);
  evaluateNodes(*data, data->movedNodes);

  const std::size_t last = foliation.layerCount();
  data->directions.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    data->directions[i] = limitDirection(foliation.node(last - 1, i), foliation.levels[last - 1],
                                         foliation.node(last, i), foliation.levels[last]);
  }
  for (const Triangle& t : mesh.triangles) {
    data->report.directionFlips +=
        orientDirections(data->directions[t[0]], data->directions[t[1]], data->directions[t[2]]) <= 0;
  }
  traceMovedNodes(*data, bent, options.tolerance);
  data->report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - startTime).count();
  return GreenChart(std::move(data));
}

}  // namespace polestar
