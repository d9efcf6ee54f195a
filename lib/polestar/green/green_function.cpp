#include "polestar/green/green_function.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/green/detail/bisect.h"
#include "polestar/green/detail/boundary_error.h"
#include "polestar/green/detail/layer_field.h"

namespace polestar {
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
  TriMesh mesh = shape.mesh();
  std::vector<double> density;
  for (;;) {
    auto quadrature = std::make_shared<const detail::LayerQuadrature>(mesh);
    detail::LayerSolution solution = detail::solveLayer(mesh, *quadrature, density, options, context);
    density = std::move(solution.density);
    record.summary.iterations += static_cast<int>(solution.residualHistory.size());
    record.summary.residualHistory = std::move(solution.residualHistory);
    ++record.summary.passes;

    const detail::LayerField field(quadrature, density);
    record.harmonicRadius = detail::harmonicRadiusOf(field);
    const detail::MeasuredBoundary measured = detail::measureBoundary(
        mesh,
        [&](std::span<const Vec3> points, std::span<double> h) {
          field.evaluatePotential(points, h, context);
        },
        record.harmonicRadius);
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
