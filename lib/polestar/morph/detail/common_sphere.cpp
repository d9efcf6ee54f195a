#include "polestar/morph/detail/common_sphere.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/edge_table.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/mesh/bisect.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar::detail {
namespace {

// Bisection halves the area: the distance to a smooth surface with it.
constexpr int kMostRounds = 24;

// Distance from p to the triangle (a, b, c). [Ericson 2004, sec. 5.1.5]
double distanceToTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto toSegment = [&](const Vec3& from, const Vec3& to) {
    const Vec3 side = to - from;
    const double share = std::clamp(side.dot(p - from) / side.squaredNorm(), 0.0, 1.0);
    return (p - from - share * side).norm();
  };
  const Vec3 normal = (b - a).cross(c - a);
  const bool above = normal.cross(b - a).dot(p - a) >= 0 && normal.cross(c - b).dot(p - b) >= 0 &&
                     normal.cross(a - c).dot(p - c) >= 0;
  if (above && normal.squaredNorm() > 0) return std::abs(normal.dot(p - a)) / normal.norm();
  return std::min({toSegment(a, b), toSegment(b, c), toSegment(c, a)});
}

// Their distances from the image of the triangle that their direction meets.
std::vector<double> distances(const CommonBoundary& boundary, const TriMesh& sphere,
                              const std::vector<Vec3>& image, std::vector<std::size_t>& triangle) {
  const SphereLocator locator(sphere.vertices, sphere.triangles);
  std::vector<double> result(boundary.samples().size(), 0);
  triangle.assign(result.size(), sphere.triangles.size());
  parallelChunks(result.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto hit = locator.locate(boundary.directions()[i]);
      if (!hit) continue;
      triangle[i] = hit->triangle;
      const Triangle& t = sphere.triangles[hit->triangle];
      const double off = distanceToTriangle(boundary.samples()[i], image[t[0]], image[t[1]], image[t[2]]);
      if (std::isfinite(off)) result[i] = off;
    }
  });
  return result;
}

void markWide(const TriMesh& sphere, double largestAngle, std::vector<char>& marked) {
  const double chord = 2 * std::sin(0.5 * largestAngle);
  for (std::size_t t = 0; t < marked.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      if ((sphere.corner(t, k) - sphere.corner(t, (k + 1) % 3)).norm() > chord) marked[t] = 1;
    }
  }
}

}  // namespace

CommonBoundary::CommonBoundary(const MorphShape& shape) : shape_(shape), surface_(shape.map) {
  const TriMesh& mesh = shape.map.chart().green().shape().mesh();
  const double unit = shape.map.chart().green().shape().frame().unit;
  samples_ = mesh.vertices;
  directions_ = shape.map.sphere().directions;
  const EdgeTable edges(mesh.triangles, mesh.vertices.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [a, b] = edges.ends(e);
    samples_.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    directions_.push_back((directions_[a] + directions_[b]).normalized());
  }
  for (Vec3& sample : samples_) sample *= unit;
  if (!shape.motion) return;
  const std::vector<Vec3> own = directions_;
  shape.motion->inverse(own, directions_);
}

std::span<const Vec3> CommonBoundary::vertexDirections() const {
  return std::span(directions_).first(shape_.map.sphere().directions.size());
}

void CommonBoundary::at(std::span<const Vec3> directions, std::span<Vec3> surface) const {
  std::vector<Vec3> own(directions.begin(), directions.end());
  if (shape_.motion) shape_.motion->forward(directions, own);
  surface_.at(own, surface);
  for (Vec3& x : surface) x -= shape_.map.chart().green().shape().frame().origin;
}

void CommonBoundary::inside(std::span<const Vec3> ball, std::span<Vec3> solid) const {
  std::vector<Vec3> own(ball.begin(), ball.end());
  if (shape_.motion) shape_.motion->forward(ball, own);
  surface_.continuedInverse(own, solid);
  for (Vec3& x : solid) x -= shape_.map.chart().green().shape().frame().origin;
}

CommonSphere commonSphere(std::span<const CommonBoundary> boundaries, std::span<const MorphShape> shapes,
                          const MorphOptions& options, Context& context) {
  std::size_t most = 0;
  for (std::size_t i = 1; i < shapes.size(); ++i) {
    if (boundaries[i].vertexDirections().size() > boundaries[most].vertexDirections().size()) most = i;
  }
  CommonSphere result;
  const std::span<const Vec3> first = boundaries[most].vertexDirections();
  result.mesh = {{first.begin(), first.end()}, shapes[most].map.chart().green().shape().mesh().triangles};
  std::vector<std::vector<Vec3>> images(shapes.size());
  for (;; ++result.rounds) {
    context.throwIfCancelled();
    std::vector<char> marked(result.mesh.triangles.size(), 0);
    markWide(result.mesh, options.largestAngle, marked);
    result.worst.assign(shapes.size(), 0);
    result.rms.assign(shapes.size(), 0);
    for (std::size_t s = 0; s < shapes.size(); ++s) {
      const std::size_t known = images[s].size();
      images[s].resize(result.mesh.vertices.size());
      boundaries[s].at(std::span(result.mesh.vertices).subspan(known), std::span(images[s]).subspan(known));
      std::vector<std::size_t> triangle;
      const std::vector<double> off = distances(boundaries[s], result.mesh, images[s], triangle);
      for (std::size_t i = 0; i < off.size(); ++i) {
        result.worst[s] = std::max(result.worst[s], off[i]);
        result.rms[s] += off[i] * off[i];
        if (off[i] > options.surfaceTolerance) marked[triangle[i]] = 1;
      }
      result.rms[s] = std::sqrt(result.rms[s] / static_cast<double>(off.size()));
    }
    if (std::find(marked.begin(), marked.end(), 1) == marked.end()) return result;
    if (result.rounds == kMostRounds || result.mesh.vertices.size() >= options.mostVertices) return result;
    result.mesh = bisectLongestEdges(result.mesh, marked).mesh;
    for (std::size_t v = images[0].size(); v < result.mesh.vertices.size(); ++v)
      result.mesh.vertices[v].normalize();
  }
}

}  // namespace polestar::detail
