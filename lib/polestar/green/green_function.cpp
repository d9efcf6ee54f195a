#include "polestar/green/green_function.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>

#include <tbb/task_arena.h>

#include "polestar/core/error.h"
#include "polestar/green/detail/adaptive_layer.h"
#include "polestar/green/detail/enclosure.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/green/detail/mfs_solver.h"
#include "polestar/green/detail/point_charge_field.h"
#include "polestar/green/detail/sign_enclosure.h"
#include "polestar/mesh/principal_axes.h"

namespace polestar {
namespace {

// Of the tolerance, what truncated sums may spoil when the error is to be proved.
constexpr double kTruncation = 0.02;

// Puts an enclosure in the place of the sampled error, where there is one.
void enclose(const detail::LayerField& field, const GreenOptions& options, GreenRecord& record,
             Context& context) {
  const std::size_t triangles = field.mesh().triangles.size();
  const detail::Enclosure e =
      detail::encloseBoundary(field, record.harmonicRadius,
                              {.goal = 0.1 * options.tolerance, .points = 10 * triangles + 50000}, context);
  BoundaryError& error = record.boundaryError;
  error.points += e.points;
  if (!std::isfinite(e.bound)) return;
  error.sampled = std::max(error.max, e.largest);
  error.max = e.bound;
  error.worst = e.weakest;
  error.truncation = (1 + 1e-9) * e.truncation;  // a limit that the same order keeps again
  error.bound = true;
}

// Just below the surface; where that fails, deeper, until no critical point but the center is left. Depths at
// which the weakest faces fail again are passed over.
std::vector<SignProof> encloseSigns(const detail::LayerField& field, Context& context) {
  const std::size_t points = 20 * field.mesh().triangles.size() + 50000;
  std::vector<SignProof> proofs{detail::encloseSigns(field, {.delta = 1e-3, .points = points}, context)};
  for (const double delta : {2e-3, 5e-3, 1e-2, 2e-2}) {
    if (proofs.back().proved()) break;
    const detail::SignOptions options{.delta = delta, .points = points};
    std::vector<std::uint32_t> weakest;
    for (const SignProof::Face& face : proofs.back().weakest) weakest.push_back(face.triangle);
    if (detail::radialSignHolds(field, options, weakest, context))
      proofs.push_back(detail::encloseSigns(field, options, context));
  }
  return proofs;
}

/// The field of sources that were solved for before. Its plan is built when a value is first asked for: who
/// reads a map for its table needs none.
class RestoredField final : public HarmonicField {
 public:
  RestoredField(StarShape shape, GreenSources sources, const GreenRecord& record)
      : shape_(std::move(shape)),
        sources_(std::move(sources)),
        accuracy_(record.accuracy),
        truncation_(record.boundaryError.bound ? record.boundaryError.truncation / record.harmonicRadius
                                               : std::numeric_limits<double>::infinity()) {}

  void evaluate(std::span<const Vec3> points, std::span<double> h, std::span<Vec3> gradient) const override {
    std::call_once(once_, [&] {
      // A thread that waits for the build must not begin another call of this in the meantime.
      tbb::this_task_arena::isolate([&] { plan_ = plan(); });
    });
    plan_->evaluate(points, h, gradient);
  }

 private:
  std::unique_ptr<const HarmonicField> plan() const {
    const auto* layer = std::get_if<SurfaceLayer>(&sources_);
    if (!layer) return std::make_unique<detail::PointChargeField>(std::get<PointSources>(sources_));
    return std::make_unique<detail::LayerField>(
        std::make_shared<const detail::AlignedSurface>(layer->mesh, principalAxes(shape_.mesh()),
                                                       Context::quiet()),
        layer->density, accuracy_, Context::quiet(), truncation_);
  }

  StarShape shape_;
  GreenSources sources_;
  double accuracy_, truncation_;
  mutable std::once_flag once_;
  mutable std::unique_ptr<const HarmonicField> plan_;
};

}  // namespace

void GreenOptions::validate() const {
  if (!(tolerance > 0)) throw Error(Errc::usage, "GreenOptions: tolerance must be positive");
  if (!(residual > 0 && residual < 1)) throw Error(Errc::usage, "GreenOptions: residual must lie in (0, 1)");
  if (maxPasses < 1) throw Error(Errc::usage, "GreenOptions: maxPasses must be positive");
  if (!(growth >= 1)) throw Error(Errc::usage, "GreenOptions: growth must be at least 1");
  if (spareVertices < 0) throw Error(Errc::usage, "GreenOptions: spareVertices must not be negative");
  if (maxIterations < 1) throw Error(Errc::usage, "GreenOptions: maxIterations must be positive");
  if (neighbours < 1) throw Error(Errc::usage, "GreenOptions: neighbours must be positive");
  if (prove && solver != GreenSolver::layer)
    throw Error(Errc::usage, "GreenOptions: only the error of the solver 'layer' can be proved");
  mfs.validate();
}

double totalCharge(const TriMesh& mesh, std::span<const double> density) {
  const std::vector<double> area = vertexAreas(mesh);
  double charge = 0;
  for (std::size_t i = 0; i < area.size(); ++i) charge += area[i] * density[i];
  return charge;
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

GreenFunction GreenFunction::onRefined(StarShape finer) const {
  return GreenFunction(
      std::make_shared<const Data>(Data{std::move(finer), data_->sources, data_->field, data_->record}));
}

GreenFunction solveGreen(const StarShape& shape, const GreenOptions& options, Context& context) {
  options.validate();
  if (options.solver == GreenSolver::mfs) return detail::solveGreenByCharges(shape, options.mfs, context);
  detail::SolvedLayer layer = detail::solveAdaptively(shape, options, context);
  const auto start = std::chrono::steady_clock::now();
  const double truncation = options.prove ? kTruncation * options.tolerance / layer.record.harmonicRadius
                                          : std::numeric_limits<double>::infinity();
  auto field = std::make_shared<const detail::LayerField>(layer.surface, layer.density, layer.record.accuracy,
                                                          context, truncation);
  if (options.prove) {
    enclose(*field, options, layer.record, context);
    layer.record.signs = encloseSigns(*field, context);
    layer.record.summary.secondsOfProof =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return GreenFunction(std::make_shared<const GreenFunction::Data>(
      GreenFunction::Data{shape, SurfaceLayer{std::move(layer.mesh), std::move(layer.density)},
                          std::move(field), std::move(layer.record)}));
}

GreenFunction restoreGreen(StarShape shape, GreenSources sources, GreenRecord record) {
  auto field = std::make_shared<const RestoredField>(shape, sources, record);
  return GreenFunction(std::make_shared<const GreenFunction::Data>(
      GreenFunction::Data{std::move(shape), std::move(sources), std::move(field), std::move(record)}));
}

}  // namespace polestar
