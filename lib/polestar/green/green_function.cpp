#include "polestar/green/green_function.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>

#include "polestar/core/error.h"
#include "polestar/green/detail/bisect.h"
#include "polestar/green/detail/device_sums.h"
#include "polestar/green/detail/layer_field.h"

namespace polestar {
namespace {

// Where rho |G| is measured: the vertices, since the equation holds there only on average, and points that no
// equation knows of: two on every edge, off its middle (a charge sits there) and alike from both ends (no
// numbering of vertices may matter), and three in every triangle.
struct BoundarySamples {
  std::vector<Vec3> points;
  std::vector<std::array<std::int32_t, 2>> edges;  // two samples each follow the vertices

  explicit BoundarySamples(const TriMesh& mesh) : points(mesh.vertices) {
    constexpr double kGolden = 0.3819660112501051;
    for (const Triangle& corner : mesh.triangles) {
      for (int k = 0; k < 3; ++k) {
        const std::int32_t a = corner[k], b = corner[(k + 1) % 3];
        if (a > b) continue;
        edges.push_back({a, b});
        const Vec3 along = mesh.vertices[b] - mesh.vertices[a];
        points.push_back(mesh.vertices[a] + kGolden * along);
        points.push_back(mesh.vertices[b] - kGolden * along);
      }
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Vec3 sum = mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2);
      for (int k = 0; k < 3; ++k) points.push_back((sum + 3 * mesh.corner(t, k)) / 6);
    }
  }
};

// The boundary error, and the largest error each triangle sees on itself, its edges and corners.
struct Measured {
  BoundaryError error;
  std::vector<double> byTriangle;
};

Measured measureBoundary(const TriMesh& mesh, const detail::LayerField& field, double harmonicRadius,
                         Context& context) {
  const BoundarySamples samples(mesh);
  std::vector<double> value(samples.points.size());
  field.evaluatePotential(samples.points, value, context);
  Measured measured;
  BoundaryError& error = measured.error;
  error.points = value.size();
  double sum = 0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    value[i] = std::abs(harmonicRadius * (1 / samples.points[i].norm() + value[i]));
    sum += value[i] * value[i];
    if (!(value[i] <= error.max)) {
      error.max = value[i];
      error.worst = samples.points[i];
    }
  }
  error.rms = std::sqrt(sum / static_cast<double>(value.size()));

  // Edge samples reach both triangles through their ends: an edge is known by its pair of vertices.
  const std::size_t n = mesh.vertices.size(), faceBegin = n + 2 * samples.edges.size();
  std::map<std::array<std::int32_t, 2>, double> onEdge;
  for (std::size_t e = 0; e < samples.edges.size(); ++e)
    onEdge[samples.edges[e]] = std::max(value[n + 2 * e], value[n + 2 * e + 1]);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    double worst = 0;
    for (int k = 0; k < 3; ++k) {
      const std::int32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      worst = std::max(
          {worst, value[a], value[faceBegin + 3 * t + k], onEdge.at({std::min(a, b), std::max(a, b)})});
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

}  // namespace

void GreenOptions::validate() const {
  if (!(residual > 0 && residual < 1)) throw Error(Errc::usage, "GreenOptions: residual must lie in (0, 1)");
  if (!(boundaryTolerance > 0)) throw Error(Errc::usage, "GreenOptions: boundaryTolerance must be positive");
  if (maxPasses < 1) throw Error(Errc::usage, "GreenOptions: maxPasses must be positive");
  if (!(growth >= 1)) throw Error(Errc::usage, "GreenOptions: growth must be at least 1");
  if (maxIterations < 1) throw Error(Errc::usage, "GreenOptions: maxIterations must be positive");
  if (neighbours < 1) throw Error(Errc::usage, "GreenOptions: neighbours must be positive");
}

void GreenFunction::evaluate(std::span<const Vec3> points, std::span<double> green,
                             std::span<Vec3> gradient) const {
  field().evaluate(points, green, gradient);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double r = points[i].norm();
    if (r > 0) {
      green[i] += 1 / r;
      gradient[i] -= points[i] / (r * r * r);
    } else {
      green[i] = std::numeric_limits<double>::infinity();
      gradient[i].setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
}

double GreenFunction::ballRadius(double green) const {
  return 1 / (1 + harmonicRadius() * std::max(green, 0.0));
}

GreenFunction solveGreen(const StarShape& shape, const GreenOptions& options, Context& context) {
  options.validate();
  const auto startTime = std::chrono::steady_clock::now();
  const double largest = options.growth * static_cast<double>(shape.mesh().vertices.size()) + 1000;
  GreenRecord record;
  record.summary.solver = "layer";
  const std::shared_ptr<detail::PairDevice> device = detail::PairDevice::open(options.device, context);
  TriMesh mesh = shape.mesh();
  std::vector<double> density;
  for (;;) {
    auto quadrature = std::make_shared<const detail::LayerQuadrature>(mesh);
    detail::LayerSolution solution = detail::solveLayer(mesh, *quadrature, density, options, device, context);
    density = std::move(solution.density);
    record.summary.iterations += static_cast<int>(solution.residualHistory.size());
    record.summary.residualHistory = std::move(solution.residualHistory);
    ++record.summary.passes;

    const detail::LayerField field(quadrature, density);
    record.harmonicRadius = harmonicRadiusOf(field);
    const Measured measured = measureBoundary(mesh, field, record.harmonicRadius, context);
    record.boundaryError = measured.error;
    if (record.boundaryError.max <= options.boundaryTolerance || record.summary.passes >= options.maxPasses)
      break;

    // Split what misses the tolerance, and what is close enough to it to miss it next time.
    std::vector<char> marked(mesh.triangles.size());
    for (std::size_t t = 0; t < marked.size(); ++t)
      marked[t] = measured.byTriangle[t] > 0.7 * options.boundaryTolerance;
    detail::Refinement refined = detail::bisectLongestEdges(mesh, marked);
    if (static_cast<double>(refined.mesh.vertices.size()) > largest) break;
    for (const auto& [a, b] : refined.parents) density.push_back(0.5 * (density[a] + density[b]));
    mesh = std::move(refined.mesh);
    context.log(LogLevel::debug, "boundary error " + std::to_string(record.boundaryError.max) +
                                     ": layer split to " + std::to_string(mesh.vertices.size()) +
                                     " vertices");
  }

  const std::vector<double> area = vertexAreas(mesh);
  double total = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    record.charge += area[i] * density[i];
    total += area[i];
    if (!(density[i] < 0)) record.wrongSignArea += area[i];
  }
  record.wrongSignArea /= total;
  record.summary.residual =
      record.summary.residualHistory.empty() ? 0 : record.summary.residualHistory.back();
  record.summary.device = device && device->works() ? device->name() : "cpu";
  record.summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - startTime).count();
  return restoreGreen(shape, std::move(mesh), std::move(density), std::move(record));
}

GreenFunction restoreGreen(StarShape shape, TriMesh layerMesh, std::vector<double> density,
                           GreenRecord record) {
  auto quadrature = std::make_shared<const detail::LayerQuadrature>(layerMesh);
  auto field = std::make_shared<const detail::LayerField>(quadrature, density);
  return GreenFunction(std::make_shared<const GreenFunction::Data>(
      GreenFunction::Data{std::move(shape), std::make_shared<const TriMesh>(std::move(layerMesh)),
                          std::move(field), std::move(density), std::move(record)}));
}

}  // namespace polestar
