#include "polestar/green/detail/boundary_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "polestar/core/detail/edge_table.h"

namespace polestar::detail {
namespace {

// Two points on every edge, off its middle (the layer has a charge there) and alike from both ends (no
// numbering of vertices may matter).
std::array<Vec3, 2> edgePoints(const Vec3& a, const Vec3& b) {
  constexpr double kGolden = 0.3819660112501051;
  return {a + kGolden * (b - a), b - kGolden * (b - a)};
}

std::array<Vec3, 3> facePoints(const TriMesh& mesh, std::size_t t) {
  const Vec3 sum = mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2);
  return {(sum + 3 * mesh.corner(t, 0)) / 6, (sum + 3 * mesh.corner(t, 1)) / 6,
          (sum + 3 * mesh.corner(t, 2)) / 6};
}

// The vertices, then the edges' points, then the triangles'.
std::vector<Vec3> samplePoints(const TriMesh& mesh, const EdgeTable& edges) {
  std::vector<Vec3> points = mesh.vertices;
  points.reserve(points.size() + 2 * edges.size() + 3 * mesh.triangles.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto& [a, b] = edges.ends(e);
    for (const Vec3& p : edgePoints(mesh.vertices[a], mesh.vertices[b])) points.push_back(p);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const Vec3& p : facePoints(mesh, t)) points.push_back(p);
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

void measureTriangles(const TriMesh& mesh, const std::vector<char>& look, const HarmonicPotential& h,
                      double harmonicRadius, std::vector<double>& byTriangle) {
  // Points of an edge between two marked triangles come twice: that is simpler than a table, and there are
  // few.
  std::vector<Vec3> points;
  for (std::size_t t = 0; t < look.size(); ++t) {
    if (!look[t]) continue;
    for (int k = 0; k < 3; ++k) {
      for (const Vec3& p : edgePoints(mesh.corner(t, k), mesh.corner(t, (k + 1) % 3))) points.push_back(p);
    }
    for (const Vec3& p : facePoints(mesh, t)) points.push_back(p);
  }
  if (points.empty()) return;
  std::vector<double> value(points.size());
  h(points, value);
  std::size_t at = 0;
  for (std::size_t t = 0; t < look.size(); ++t) {
    if (!look[t]) continue;
    for (int i = 0; i < 9; ++i, ++at)
      byTriangle[t] = std::max(byTriangle[t], std::abs(harmonicRadius * (1 / points[at].norm() + value[at])));
  }
}

double harmonicRadiusOf(const HarmonicField& field) {
  const Vec3 center = Vec3::Zero();
  double h;
  Vec3 gradient;
  field.evaluate({&center, 1}, {&h, 1}, {&gradient, 1});
  return -1 / h;
}

}  // namespace polestar::detail
