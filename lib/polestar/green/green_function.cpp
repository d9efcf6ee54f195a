#include "polestar/green/green_function.h"

#include <algorithm>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/green/detail/adaptive_layer.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/green/detail/mfs_solver.h"
#include "polestar/green/detail/point_charge_field.h"

namespace polestar {
void GreenOptions::validate() const {
  if (!(tolerance > 0)) throw Error(Errc::usage, "GreenOptions: tolerance must be positive");
  if (!(residual > 0 && residual < 1)) throw Error(Errc::usage, "GreenOptions: residual must lie in (0, 1)");
  if (maxPasses < 1) throw Error(Errc::usage, "GreenOptions: maxPasses must be positive");
  if (!(growth >= 1)) throw Error(Errc::usage, "GreenOptions: growth must be at least 1");
  if (spareVertices < 0) throw Error(Errc::usage, "GreenOptions: spareVertices must not be negative");
  if (maxIterations < 1) throw Error(Errc::usage, "GreenOptions: maxIterations must be positive");
  if (neighbours < 1) throw Error(Errc::usage, "GreenOptions: neighbours must be positive");
  mfs.validate();
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
  if (options.solver == GreenSolver::mfs) return detail::solveGreenByCharges(shape, options.mfs, context);
  detail::SolvedLayer layer = detail::solveAdaptively(shape, options, context);
  return restoreGreen(shape, SurfaceLayer{std::move(layer.mesh), std::move(layer.density)},
                      std::move(layer.record));
}

GreenFunction restoreGreen(StarShape shape, GreenSources sources, GreenRecord record) {
  std::shared_ptr<const HarmonicField> field;
  if (const auto* layer = std::get_if<SurfaceLayer>(&sources)) {
    field = std::make_shared<const detail::LayerField>(layer->mesh, layer->density, record.accuracy,
                                                       Context::quiet());
  } else {
    field = std::make_shared<const detail::PointChargeField>(std::get<PointSources>(sources));
  }
  return GreenFunction(std::make_shared<const GreenFunction::Data>(
      GreenFunction::Data{std::move(shape), std::move(sources), std::move(field), std::move(record)}));
}

}  // namespace polestar
