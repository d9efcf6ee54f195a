#include "polestar/green/detail/adaptive_layer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string>

#include "polestar/core/error.h"
#include "polestar/green/detail/bisect.h"
#include "polestar/green/detail/boundary_error.h"
#include "polestar/green/detail/device_sums.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/green/detail/principal_axes.h"

namespace polestar::detail {
namespace {

// Solves, looks where the boundary error sits, splits there and solves again.
class LayerRun {
 public:
  LayerRun(const StarShape& shape, const GreenOptions& options, Context& context)
      : shape_(shape),
        options_(options),
        context_(context),
        mesh_(shape.mesh()),
        axes_(principalAxes(mesh_)),
        device_(PairDevice::open(options.device, context)) {
    record_.summary.solver = "layer";
    // Until the splits are done a residual well below the tolerance is enough.
    record_.accuracy = std::max(options.residual, 0.01 * options.tolerance);
  }

  SolvedLayer run() {
    const auto start = std::chrono::steady_clock::now();
    const double largest =
        options_.growth * static_cast<double>(mesh_.vertices.size()) + options_.spareVertices;
    for (;;) {
      solve();
      if (record_.boundaryError.max <= options_.tolerance) {
        record_.summary.stop = "tolerance reached";
        break;
      }
      if (record_.summary.passes >= options_.maxPasses) {
        record_.summary.stop = "passes spent";
        break;
      }
      if (!split(largest)) {
        record_.summary.stop = "budget spent";
        break;
      }
    }
    finish();
    const std::vector<double> area = vertexAreas(mesh_);
    double charge = 0;
    for (std::size_t i = 0; i < area.size(); ++i) charge += area[i] * density_[i];
    record_.charge = charge;
    record_.summary.device = device_ && device_->works() ? device_->name() : "cpu";
    record_.summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return {std::move(mesh_), std::move(density_), std::move(record_)};
  }

 private:
  void solve() {
    turned_ = turned(mesh_, axes_);
    quadrature_ = std::make_shared<const LayerQuadrature>(turned_, context_);
    equation_.emplace(turned_, quadrature_, options_.neighbours, context_);
    ++record_.summary.passes;
    iterate();
    measure();
  }

  void iterate() {
    const LayerSolution solution = equation_->solve(
        density_, {.residual = record_.accuracy, .maxIterations = options_.maxIterations, .device = device_},
        context_);
    record_.summary.iterations += static_cast<int>(solution.residualHistory.size());
    record_.summary.residualHistory = solution.residualHistory;
    record_.summary.residual = solution.residual;
    if (!(solution.residual <= record_.accuracy)) {
      const Vec3 place =
          shape_.frame().toWorld(mesh_.vertices[static_cast<std::size_t>(solution.worstVertex)]);
      throw Error(
          Errc::notConverged,
          "the Green's function did not converge: residual " + formatHistory(solution.residualHistory) +
              ", largest near " + formatPoint(place) +
              "; the mesh probably has needles or nearly touching sheets there: remesh it more evenly");
    }
    density_ = solution.density;
  }

  // Potential of the layer at points of the surface, and at the center.
  void measure() {
    const NearField::Density density = quadrature_->near().density(density_);
    const std::vector<double> charge = quadrature_->chargesFor(density_);
    auto potential = [&](std::span<const Vec3> points, std::span<double> h) {
      makeSums(quadrature_->places(), points, 0.01 * options_.tolerance, device_)
          ->potential(charge, h, context_);
      quadrature_->addNearPotential(points, density, h, context_);
    };
    const Vec3 center = Vec3::Zero();
    double atCenter = 0;
    potential({&center, 1}, {&atCenter, 1});
    record_.harmonicRadius = -1 / atCenter;
    measured_ = measureBoundary(turned_, potential, record_.harmonicRadius);
    measured_.error.worst = axes_.transpose() * measured_.error.worst;
    record_.boundaryError = measured_.error;
  }

  // Halves triangles until the error that is expected of their pieces, which falls like their diameter, is
  // within the tolerance; false when the budget does not allow it.
  bool split(double largest) {
    constexpr double kGain = 0.7071;  // of the error by one bisection
    constexpr int kRounds = 4;
    std::vector<double> expected = measured_.byTriangle;
    for (int round = 0; round < kRounds; ++round) {
      std::vector<char> marked(mesh_.triangles.size());
      // What is close to the tolerance would miss it next time.
      for (std::size_t t = 0; t < marked.size(); ++t) marked[t] = expected[t] > 0.7 * options_.tolerance;
      if (std::find(marked.begin(), marked.end(), 1) == marked.end()) break;
      Refinement refined = bisectLongestEdges(mesh_, marked);
      if (static_cast<double>(refined.mesh.vertices.size()) > largest) return round > 0;
      for (const auto& [a, b] : refined.parents) density_.push_back(0.5 * (density_[a] + density_[b]));
      std::vector<double> finer(refined.mesh.triangles.size());
      for (std::size_t t = 0; t < finer.size(); ++t) {
        const std::uint32_t parent = refined.triangleParents[t];
        // Pieces of one triangle lie side by side.
        const bool cut = (t > 0 && refined.triangleParents[t - 1] == parent) ||
                         (t + 1 < finer.size() && refined.triangleParents[t + 1] == parent);
        finer[t] = (cut ? kGain : 1) * expected[parent];
      }
      expected = std::move(finer);
      mesh_ = std::move(refined.mesh);
    }
    context_.log(LogLevel::debug, "boundary error " + std::to_string(record_.boundaryError.max) +
                                      ": layer split to " + std::to_string(mesh_.vertices.size()) +
                                      " vertices");
    return true;
  }

  // To the residual that was asked for, or the smaller one that narrow parts need: along them the density
  // falls exponentially, and with it what the potential must be exact to.
  void finish() {
    constexpr double kFinest = 1e-10;  // what the sums of the highest order can tell apart
    constexpr int kAttempts = 3;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const double needed = std::min(options_.residual, std::max(kFinest, 0.1 * kNoise * smallestFlux()));
      if (needed >= record_.accuracy) break;
      record_.accuracy = needed;
      iterate();
    }
    measure();
    record_.unresolvedArea = unresolvedArea();
  }

  // e = eps / (4 pi |sigma| h), h = sqrt(area), compares the potential's error across a triangle with the
  // flux through it; beyond kNoise, field lines there are noise.
  static constexpr double kNoise = 0.03;
  template <class Visit>
  void visitFlux(Visit&& visit) const {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& c = mesh_.triangles[t];
      const double area = quadrature_->area(t);
      const double sigma = -(density_[c[0]] + density_[c[1]] + density_[c[2]]) / 3;
      visit(area, 4 * std::numbers::pi * sigma * std::sqrt(area));
    }
  }
  double smallestFlux() const {
    double smallest = 1;
    visitFlux([&](double, double flux) {
      if (flux > 0) smallest = std::min(smallest, flux);
    });
    return smallest;
  }
  double unresolvedArea() const {
    double unresolved = 0, total = 0;
    visitFlux([&](double area, double flux) {
      total += area;
      if (!(record_.accuracy < kNoise * flux)) unresolved += area;
    });
    return unresolved / total;
  }

  static std::string formatHistory(const std::vector<double>& history) {
    std::string text;
    char number[32];
    for (std::size_t i = 0; i < history.size(); i += std::max<std::size_t>(1, history.size() / 8)) {
      std::snprintf(number, sizeof number, "%s%zu:%.1e", text.empty() ? "" : " ", i + 1, history[i]);
      text += number;
    }
    return text;
  }
  static std::string formatPoint(const Vec3& p) {
    char text[96];
    std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g)", p[0], p[1], p[2]);
    return text;
  }

  const StarShape& shape_;
  const GreenOptions& options_;
  Context& context_;
  TriMesh mesh_;
  Mat3 axes_;
  TriMesh turned_;  // mesh_ along the axes
  std::vector<double> density_;
  std::shared_ptr<const LayerQuadrature> quadrature_;
  std::optional<LayerEquation> equation_;
  MeasuredBoundary measured_;
  std::shared_ptr<PairDevice> device_;
  GreenRecord record_;
};

}  // namespace

SolvedLayer solveAdaptively(const StarShape& shape, const GreenOptions& options, Context& context) {
  return LayerRun(shape, options, context).run();
}

}  // namespace polestar::detail
