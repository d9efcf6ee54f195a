#include "polestar/green/detail/boundary_error.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "polestar/core/detail/edge_table.h"

namespace polestar::detail {
namespace {

// The vertices, then two points on every edge, off its middle (the layer has a charge there) and alike from
// both ends (no numbering of vertices may matter), then three in every triangle.
std::vector<Vec3> samplePoints(const TriMesh& mesh, const EdgeTable& edges) {
  constexpr double kGolden = 0.3819660112501051;
  std::vector<Vec3> points = mesh.vertices;
  points.reserve(points.size() + 2 * edges.size() + 3 * mesh.triangles.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto& [a, b] = edges.ends(e);
    const Vec3 along = mesh.vertices[b] - mesh.vertices[a];
    points.push_back(mesh.vertices[a] + kGolden * along);
    points.push_back(mesh.vertices[b] - kGolden * along);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 sum = mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2);
    for (int k = 0; k < 3; ++k) points.push_back((sum + 3 * mesh.corner(t, k)) / 6);
  }
  return points;
}

}  // namespace

MeasuredBoundary measureBoundary(const TriMesh& mesh, const HarmonicPotential& h, double harmonicRadius) {
  const EdgeTable edges(mesh.triangles, mesh.vertices.size());
  const std::vector<Vec3> points = samplePoints(mesh, edges);
  std::vector<double> value(points.size());
  h(points, value);
  MeasuredBoundary measured;
  BoundaryError& error = measured.error;
  error.points = points.size();
  double sum = 0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    value[i] = std::abs(harmonicRadius * (1 / points[i].norm() + value[i]));
    if (std::isnan(value[i]))
      value[i] = std::numeric_limits<double>::infinity();  // or the maximum would miss it
    sum += value[i] * value[i];
    if (!(value[i] <= error.max)) {
      error.max = value[i];
      error.worst = points[i];
    }
  }
  error.rms = std::sqrt(sum / static_cast<double>(value.size()));

  const std::size_t n = mesh.vertices.size(), faceBegin = n + 2 * edges.size();
  measured.byTriangle.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    double worst = 0;
    for (int k = 0; k < 3; ++k) {
      const std::size_t a = mesh.triangles[t][k];
      const std::size_t onEdge = n + 2 * static_cast<std::size_t>(edges.edgeOf(3 * t + k));
      worst = std::max({worst, value[a], value[faceBegin + 3 * t + k], value[onEdge], value[onEdge + 1]});
    }
    measured.byTriangle.push_back(worst);
  }
  return measured;
}

double harmonicRadiusOf(const HarmonicField& field) {
  const Vec3 center = Vec3::Zero();
  double h;
  Vec3 gradient;
  field.evaluate({&center, 1}, {&h, 1}, {&gradient, 1});
  return -1 / h;
}

}  // namespace polestar::detail
