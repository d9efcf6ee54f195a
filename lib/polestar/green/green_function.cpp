#include "polestar/green/green_function.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/green/detail/layer_field.h"

namespace polestar {
namespace {

// Boundary points that are no collocation points of the layer (those are vertices and centroids): on every edge off
// its middle, where a charge sits, and three in every triangle; the vertices too, since the equation holds there only
// on average. Thinned evenly to `limit`.
std::vector<Vec3> boundarySamples(const TriMesh& mesh, std::size_t limit) {
  constexpr double kGolden = 0.3819660112501051;
  std::vector<Vec3> points = mesh.vertices;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corner = mesh.triangles[t];
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = mesh.corner(t, k), &b = mesh.corner(t, (k + 1) % 3), &c = mesh.corner(t, (k + 2) % 3);
      if (corner[k] < corner[(k + 1) % 3]) points.push_back(a + kGolden * (b - a));
      points.push_back((4 * a + b + c) / 6);
    }
  }
  if (points.size() <= limit) return points;
  std::vector<Vec3> thinned;
  thinned.reserve(limit);
  for (std::size_t i = 0; i < limit; ++i) thinned.push_back(points[i * points.size() / limit]);
  return thinned;
}

BoundaryError measureBoundary(const TriMesh& mesh, const HarmonicField& field, double harmonicRadius,
                              Context& context) {
  constexpr std::size_t kLimit = 40000, kBatch = 2048;
  const std::vector<Vec3> points = boundarySamples(mesh, kLimit);
  std::vector<double> h(points.size());
  std::vector<Vec3> gradient(points.size());
  BoundaryError error;
  error.points = points.size();
  double sum = 0;
  for (std::size_t begin = 0; begin < points.size(); begin += kBatch) {
    context.throwIfCancelled();
    context.progress("measuring the boundary error", static_cast<double>(begin) / static_cast<double>(points.size()));
    const std::size_t count = std::min(kBatch, points.size() - begin);
    field.evaluate({&points[begin], count}, {&h[begin], count}, {&gradient[begin], count});
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double e = std::abs(harmonicRadius * (1 / points[i].norm() + h[i]));
    sum += e * e;
    if (e > error.max) {
      error.max = e;
      error.worst = points[i];
    }
  }
  error.rms = std::sqrt(sum / static_cast<double>(points.size()));
  return error;
}

}  // namespace

void GreenOptions::validate() const {
  if (!(tolerance > 0 && tolerance < 1)) throw Error(Errc::usage, "GreenOptions: tolerance must lie in (0, 1)");
  if (maxIterations < 1) throw Error(Errc::usage, "GreenOptions: maxIterations must be positive");
  if (neighbours < 1) throw Error(Errc::usage, "GreenOptions: neighbours must be positive");
}

GreenFunction::GreenFunction(StarShape shape, std::shared_ptr<const HarmonicField> field, std::vector<double> density,
                             GreenSummary summary, Context& context) {
  auto data = std::make_shared<Data>(Data{std::move(shape), std::move(field), std::move(density), std::move(summary)});
  const TriMesh& mesh = data->shape.mesh();

  const Vec3 center = Vec3::Zero();
  double h;
  Vec3 gradient;
  data->field->evaluate({&center, 1}, {&h, 1}, {&gradient, 1});
  data->harmonicRadius = -1 / h;

  double area = 0, wrong = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double third = areaVector(mesh, t).norm() / 6;
    for (const std::int32_t v : mesh.triangles[t]) {
      data->charge += third * data->density[v];
      area += third;
      if (!(data->density[v] < 0)) wrong += third;
    }
  }
  data->wrongSignArea = wrong / area;
  data->boundaryError = measureBoundary(mesh, *data->field, data->harmonicRadius, context);
  data_ = std::move(data);
}

void GreenFunction::evaluate(std::span<const Vec3> points, std::span<double> green, std::span<Vec3> gradient) const {
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
  auto quadrature = std::make_shared<const detail::LayerQuadrature>(shape.mesh());
  detail::LayerSolution solution = detail::solveLayer(shape.mesh(), *quadrature, options, context);
  auto field = std::make_shared<const detail::LayerField>(quadrature, solution.density);
  return GreenFunction(shape, field, std::move(solution.density), std::move(solution.summary), context);
}

}  // namespace polestar
