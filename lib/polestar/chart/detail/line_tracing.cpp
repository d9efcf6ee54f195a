#include "polestar/chart/detail/line_tracing.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

constexpr int kAttempts = 10;  // at deeper and deeper starts
constexpr double kDeeper = 1.6, kShallower = 0.6;
constexpr std::size_t kBatch = 256;  // lines between two looks at cancellation

}  // namespace

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

LineTracing::LineTracing(GreenChart::Data& data, const ChartOptions& options, ChartSurface surface,
                         double firstTraced)
    : data_(data),
      surface_(std::move(surface)),
      levels_(std::span(data.foliation.levels).subspan(1)),
      startDepth_(options.startDepth),
      shallowestStart_(firstTraced + 0.2 * (1 - firstTraced)),
      tracer_(data.green, options.tolerance) {
  setSurfaceValues(0);
}

// G = 0 gives h and its tangential gradient, the slope of G the normal one.
void LineTracing::setSurfaceValues(std::size_t firstVertex) {
  const TriMesh& mesh = data_.green.shape().mesh();
  for (std::size_t i = firstVertex; i < mesh.vertices.size(); ++i) {
    const Vec3& v = mesh.vertices[i];
    data_.foliation.nodes[i] = v;
    data_.h[i] = -1 / v.norm();
    data_.gradient[i] = v / std::pow(v.norm(), 3) + surface_.slopes[i] * surface_.frames[i].normal;
  }
}

void LineTracing::refineSurface(const StarShape& finer,
                                std::span<const std::array<std::int32_t, 2>> parents) {
  Foliation& f = data_.foliation;
  const std::size_t before = f.vertexCount, after = finer.mesh().vertices.size();
  // Nodes lie level by level.
  const auto spread = [&](auto& values) {
    std::remove_reference_t<decltype(values)> wider(f.levels.size() * after + 1);
    for (std::size_t level = 0; level < f.levels.size(); ++level) {
      for (std::size_t v = 0; v < after; ++v)
        wider[level * after + v] = v < before ? values[level * before + v] : values.back();
    }
    wider.back() = values.back();
    values = std::move(wider);
  };
  spread(f.nodes);
  spread(data_.h);
  spread(data_.gradient);
  f.vertexCount = after;
  f.triangles = finer.mesh().triangles;
  data_.green = data_.green.onRefined(finer);
  for (const auto& [a, b] : parents)
    surface_.slopes.push_back(0.5 * (surface_.slopes[a] + surface_.slopes[b]));
  surface_.frames = vertexFrames(finer.mesh());
  setSurfaceValues(before);
}

// A little inside, along the field, above the first level.
Vec3 LineTracing::findStart(const Vec3& vertex, const VertexFrame& frame, double depth) const {
  Vec3 start = vertex;
  for (int shorter = 0; shorter < 40; ++shorter, depth *= kShallower) {
    Vec3 direction = -frame.normal, gradient;
    double green;
    // The field at the start turns the way towards itself; close to a crease the normal alone would miss the
    // line.
    for (int turn = 0; turn < 3; ++turn) {
      start = vertex + depth * direction;
      data_.green.evaluate({&start, 1}, {&green, 1}, {&gradient, 1});
      const Vec3 inward = gradient.normalized();
      if (!(inward.dot(frame.normal) < -0.05)) break;
      direction = (direction + inward).normalized();
    }
    start = vertex + depth * direction;
    data_.green.evaluate({&start, 1}, {&green, 1}, {&gradient, 1});
    if (1 / (1 + data_.green.harmonicRadius() * green) > shallowestStart_) break;
  }
  return start;
}

std::vector<std::int32_t> LineTracing::trace(std::span<const std::int32_t> vertices, double depth) {
  const std::vector<Vec3>& surface = data_.green.shape().mesh().vertices;
  std::vector<Vec3> starts(vertices.size());
  parallelChunks(vertices.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::int32_t v = vertices[i];
      starts[i] = findStart(surface[v], surface_.frames[v], depth * surface_.frames[v].shortestEdge);
    }
  });
  const std::vector<FieldLineTracer::Line> lines = tracer_.trace(starts, levels_);
  std::vector<std::int32_t> failed;
  std::vector<std::size_t> above;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    data_.report.evaluations += lines[i].evaluations;
    if (!lines[i].ok) {
      failed.push_back(vertices[i]);
      continue;
    }
    store(vertices[i], starts[i], lines[i], above);
  }
  evaluateNodes(data_, above);
  return failed;
}

void LineTracing::store(std::int32_t vertex, const Vec3& start, const FieldLineTracer::Line& line,
                        std::vector<std::size_t>& above) {
  Foliation& f = data_.foliation;
  for (std::size_t k = line.firstLevel; k < levels_.size(); ++k) {
    const FieldLineTracer::Node& node = line.nodes[k - line.firstLevel];
    const std::size_t id = f.nodeId(k + 1, vertex);
    f.nodes[id] = node.position;
    data_.h[id] = node.h;
    data_.gradient[id] = node.gradient;
  }
  // Levels between the surface, where R = 1, and the start: on the straight way, evenly. Correcting their
  // places by the field would follow its error, which next to the surface exceeds 1 - R.
  const Vec3 surface = f.node(0, vertex);
  for (std::size_t k = 0; k < line.firstLevel; ++k) {
    const double share = (1 - levels_[k]) / (1 - line.startRadius);
    const std::size_t id = f.nodeId(k + 1, vertex);
    f.nodes[id] = (1 - share) * surface + share * start;
    above.push_back(id);
  }
}

std::vector<std::int32_t> LineTracing::traceAll(std::vector<std::int32_t> pending, Context& context) {
  const std::size_t all = pending.size();
  double depth = startDepth_;
  for (int attempt = 0; attempt < kAttempts && !pending.empty(); ++attempt, depth *= kDeeper) {
    std::vector<std::int32_t> failed;
    for (std::size_t begin = 0; begin < pending.size(); begin += kBatch) {
      context.throwIfCancelled();
      if (attempt == 0) {
        context.progress("following field lines", static_cast<double>(begin) / static_cast<double>(all));
      }
      const auto batch = std::span(pending).subspan(begin, std::min(kBatch, pending.size() - begin));
      const std::vector<std::int32_t> lost = trace(batch, depth);
      if (attempt > 0) data_.report.deepened += batch.size() - lost.size();
      failed.insert(failed.end(), lost.begin(), lost.end());
    }
    pending = std::move(failed);
  }
  return pending;
}

}  // namespace polestar::detail
