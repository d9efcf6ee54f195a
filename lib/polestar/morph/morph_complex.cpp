#include "polestar/morph/morph_complex.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include "polestar/core/error.h"
#include "polestar/morph/detail/common_sphere.h"

namespace polestar {
namespace {

const Frame& frameOf(const BallMap& map) { return map.chart().green().shape().frame(); }

// In the ball: the outermost level of a map's own table below the surface.
double firstLevel(const BallMap& map) { return map.radius().value(map.chart().foliation().levels[1]); }

// Those of the map with the thinnest first layer, so that its own lines keep their nodes where cells are
// hardest to keep positive; as far as they are no farther apart than asked.
std::vector<double> commonLevels(std::span<const MorphShape> shapes, const MorphOptions& options) {
  const MorphShape& thinnest = *std::max_element(
      shapes.begin(), shapes.end(),
      [](const MorphShape& a, const MorphShape& b) { return firstLevel(a.map) < firstLevel(b.map); });
  std::vector<double> levels{1};
  for (const double level : thinnest.map.chart().foliation().levels) {
    const double radius = thinnest.map.radius().value(level);
    if (levels.back() - radius > options.largestStep || radius < 2 * options.innermost) break;
    if (radius < levels.back()) levels.push_back(radius);
  }
  while (levels.back() - options.largestStep > options.innermost)
    levels.push_back(levels.back() - options.largestStep);
  levels.push_back(options.innermost);
  return levels;
}

Foliation complexOf(const TriMesh& sphere, std::vector<double> levels) {
  Foliation ball;
  ball.vertexCount = sphere.vertices.size();
  ball.triangles = sphere.triangles;
  ball.levels = std::move(levels);
  ball.nodes.reserve(ball.centerNode() + 1);
  for (const double level : ball.levels) {
    for (const Vec3& direction : sphere.vertices) ball.nodes.push_back(level * direction);
  }
  ball.nodes.push_back(Vec3::Zero());
  return ball;
}

// f^-1(motion(y)) - c at all nodes. Levels that another shape needs may lie a millionth apart where this
// one's table has none: what is linear in between is as good as the table there, and layers keep their
// thickness.
std::vector<Vec3> nodesOf(const Foliation& ball, const detail::CommonBoundary& boundary, double firstLevel) {
  const std::size_t n = ball.vertexCount;
  std::vector<Vec3> nodes(ball.nodes.size());
  const std::span all(nodes);
  const std::span common(ball.nodes);
  std::size_t level = 1;
  while (ball.levels[level] > firstLevel * (1 + 1e-12)) ++level;
  boundary.at(common.first(n), all.first(n));
  boundary.inside(common.subspan(level * n), all.subspan(level * n));
  nodes.back().setZero();
  if (level == 1) return nodes;
  std::vector<Vec3> first(common.begin(), common.begin() + static_cast<std::ptrdiff_t>(n));
  for (Vec3& y : first) y *= firstLevel;
  const std::vector<Vec3> asked = first;
  boundary.inside(asked, first);
  for (std::size_t k = 1; k < level; ++k) {
    const double share = (1 - ball.levels[k]) / (1 - firstLevel);
    for (std::size_t v = 0; v < n; ++v) nodes[ball.nodeId(k, v)] = (1 - share) * nodes[v] + share * first[v];
  }
  return nodes;
}

}  // namespace

void MorphOptions::validate() const {
  if (!(surfaceTolerance > 0) || !std::isfinite(surfaceTolerance))
    throw Error(Errc::usage, "MorphOptions: surfaceTolerance must be a positive length");
  if (!(innermost > 0 && innermost < 0.25))
    throw Error(Errc::usage, "MorphOptions: innermost must lie in (0, 0.25)");
  if (!(largestStep > 0 && largestStep < 0.5))
    throw Error(Errc::usage, "MorphOptions: largestStep must lie in (0, 0.5)");
  if (!(largestAngle > 0)) throw Error(Errc::usage, "MorphOptions: largestAngle must be positive");
}

MorphComplex::MorphComplex(std::vector<MorphShape> shapes, const MorphOptions& options, Context& context) {
  options.validate();
  if (shapes.empty()) throw Error(Errc::usage, "a morph needs a shape");
  const auto start = std::chrono::steady_clock::now();
  auto data = std::make_shared<Data>();
  data->shapes = std::move(shapes);
  std::vector<detail::CommonBoundary> boundaries;
  for (const MorphShape& shape : data->shapes) boundaries.emplace_back(shape);
  context.progress("triangulating the common sphere", 0);
  const detail::CommonSphere sphere = detail::commonSphere(boundaries, data->shapes, options, context);
  data->ball = complexOf(sphere.mesh, commonLevels(data->shapes, options));
  data->report.rounds = sphere.rounds;
  const Foliation& ball = data->ball;

  for (std::size_t s = 0; s < data->shapes.size(); ++s) {
    context.throwIfCancelled();
    context.progress("inverting the maps", static_cast<double>(s) / static_cast<double>(data->shapes.size()));
    const MorphShape& shape = data->shapes[s];
    MorphReport::End end{.surfaceMax = sphere.worst[s], .surfaceRms = sphere.rms[s]};
    std::vector<Vec3> nodes = nodesOf(ball, boundaries[s], firstLevel(shape.map));
    end.mending = mendCells(ball, nodes, context);
    for (Vec3& node : nodes) node = shape.rotation.transpose() * node;
    if (end.surfaceMax > options.surfaceTolerance) {
      context.log(LogLevel::warning,
                  "the common triangles miss the surface of shape " + std::to_string(s + 1) + " by up to " +
                      std::to_string(end.surfaceMax) + "; it has finer creases than they can follow");
    }
    data->nodes.push_back(std::move(nodes));
    data->centers.push_back(frameOf(shape.map).origin);
    data->report.ends.push_back(std::move(end));
  }
  data->report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  data_ = std::move(data);
}

std::vector<Vec3> MorphComplex::nodesIn(const BallMap& map, const VolumeMap* motion) const {
  const Foliation& ball = data_->ball;
  const MorphShape shape{map, std::shared_ptr<const VolumeMap>(std::shared_ptr<void>(), motion)};
  std::vector<Vec3> nodes = nodesOf(ball, detail::CommonBoundary(shape), firstLevel(map));
  for (Vec3& node : nodes) node += frameOf(map).origin;
  return nodes;
}

}  // namespace polestar
