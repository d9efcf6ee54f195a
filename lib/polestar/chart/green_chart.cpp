#include "polestar/chart/green_chart.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "polestar/chart/detail/line_repair.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/core/predicates.h"

namespace polestar {
namespace {

constexpr int kAttempts = 10;  // at deeper and deeper starts
constexpr double kDeeper = 1.6, kShallower = 0.6;
constexpr std::size_t kBatch = 256;  // lines between two looks at cancellation

std::vector<double> chooseLevels(const ChartOptions& options, const BoundaryError& error) {
  // Thin layers at the surface, where R runs fastest through the cells, growing inward; but thicker than the
  // error of G on most of the surface. (Its maximum sits at a few creases, where lines are repaired.)
  double step = options.firstStep > 0 ? options.firstStep : std::clamp(20 * error.rms, 0.01, 0.08);
  std::vector<double> levels{1};
  while (levels.back() - step > 2 * options.innermost) {
    levels.push_back(levels.back() - step);
    step = std::min(1.6 * step, options.largestStep);
  }
  levels.push_back(options.innermost);
  return levels;
}

// What a vertex knows of its neighbourhood.
struct VertexFrame {
  Vec3 normal = Vec3::Zero();  // angle-weighted, outward, unit
  double shortestEdge = 1e300;
};

std::vector<VertexFrame> vertexFrames(const TriMesh& mesh) {
  std::vector<VertexFrame> frames(mesh.vertices.size());
  const std::vector<Vec3> normals = vertexNormals(mesh);
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].normal = normals[i];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      double& shortest = frames[mesh.triangles[t][k]].shortestEdge;
      shortest = std::min({shortest, (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).norm(),
                           (mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k)).norm()});
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

// Traces every vertex into `data`, deeper starts for lines that fail. Returns the vertices that failed for
// good.
std::vector<std::int32_t> traceAll(GreenChart::Data& data, const ChartOptions& options,
                                   const std::vector<VertexFrame>& frames, Context& context) {
  const TriMesh& mesh = data.green.shape().mesh();
  const std::size_t n = mesh.vertices.size();
  const std::span<const double> levels = std::span(data.foliation.levels).subspan(1);
  const StartFinder finder(data.green, levels[0]);
  const FieldLineTracer tracer(data.green, options.tolerance);

  std::vector<std::int32_t> pending(n);
  for (std::size_t i = 0; i < n; ++i) pending[i] = static_cast<std::int32_t>(i);
  double depth = options.startDepth;
  for (int attempt = 0; attempt < kAttempts && !pending.empty(); ++attempt, depth *= kDeeper) {
    std::vector<std::int32_t> failed;
    for (std::size_t begin = 0; begin < pending.size(); begin += kBatch) {
      context.throwIfCancelled();
      if (attempt == 0) {
        context.progress("following field lines", static_cast<double>(begin) / static_cast<double>(n));
      }
      const std::size_t count = std::min(kBatch, pending.size() - begin);
      std::vector<Vec3> starts(count);
      detail::parallelChunks(count, 8, [&](std::size_t b, std::size_t e) {
        for (std::size_t i = b; i < e; ++i) {
          const std::int32_t v = pending[begin + i];
          starts[i] = finder.find(mesh.vertices[v], frames[v], depth * frames[v].shortestEdge);
        }
      });
      const std::vector<FieldLineTracer::Line> lines = tracer.trace(starts, levels);
      for (std::size_t i = 0; i < count; ++i) {
        const std::int32_t v = pending[begin + i];
        data.report.evaluations += lines[i].evaluations;
        if (!lines[i].ok) {
          failed.push_back(v);
          continue;
        }
        data.report.deepened += attempt > 0;
        for (std::size_t k = 0; k < levels.size(); ++k) {
          const std::size_t id = data.foliation.nodeId(k + 1, v);
          data.foliation.nodes[id] = lines[i].nodes[k].position;
          data.h[id] = lines[i].nodes[k].h;
          data.gradient[id] = lines[i].nodes[k].gradient;
        }
      }
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
void setSurfaceValues(GreenChart::Data& data, const std::vector<VertexFrame>& frames) {
  const TriMesh& mesh = data.green.shape().mesh();
  const std::vector<double> slopes = surfaceSlopes(data.green, frames);
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

  auto data = std::make_shared<GreenChart::Data>(GreenChart::Data{green, {}, {}, {}, {}, {}});
  Foliation& foliation = data->foliation;
  foliation.vertexCount = n;
  foliation.triangles = mesh.triangles;
  foliation.levels = chooseLevels(options, green.boundaryError());
  foliation.nodes.assign(foliation.centerNode() + 1, Vec3::Zero());
  data->h.assign(foliation.nodes.size(), 0.0);
  data->gradient.assign(foliation.nodes.size(), Vec3::Zero());

  const std::vector<VertexFrame> frames = vertexFrames(mesh);
  setSurfaceValues(*data, frames);
  evaluateNodes(*data, {foliation.centerNode()});
  const std::vector<std::int32_t> failed = traceAll(*data, options, frames, context);
  data->report.lines = n;
  data->report.failed = failed.size();

  const detail::LineRepair repair = detail::repairLines(foliation, failed);
  data->report.repaired = repair.lines;
  data->report.largestMove = repair.largestMove;
  data->report.cells = repair.cells;
  evaluateNodes(*data, repair.movedNodes);

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
  data->report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - startTime).count();
  return GreenChart(std::move(data));
}

}  // namespace polestar
