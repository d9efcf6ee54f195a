#include "polestar/green/detail/adaptive_layer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string>

#include "polestar/core/error.h"
#include "polestar/green/detail/boundary_error.h"
#include "polestar/green/detail/device_sums.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/mesh/bisect.h"
#include "polestar/mesh/principal_axes.h"

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
    for (const Vec3& p : mesh_.vertices) largestRadius_ = std::max(largestRadius_, p.norm());
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      width_.push_back(std::sqrt(areaVector(mesh_, t).norm()));
    // To see where the first splits belong a residual well below the tolerance is enough; later solves start
    // close to the solution, and each may be the last.
    record_.accuracy = std::max(options.residual, 0.1 * options.tolerance);
  }

  SolvedLayer run() {
    const auto start = std::chrono::steady_clock::now();
    const double largest =
        options_.growth * static_cast<double>(mesh_.vertices.size()) + options_.spareVertices;
    const double aim = 0.97 * options_.tolerance;  // between samples the error may be a little larger
    for (;;) {
      solve();
      // Looking everywhere is dear and left for the end.
      std::vector<double> error = likelyError();
      weighByFlux(error);
      const bool last = record_.summary.passes >= options_.maxPasses;
      const bool look = last || *std::max_element(error.begin(), error.end()) <= aim;
      if (look) {
        finish();
        error = measured_.byTriangle;
        weighByFlux(error);
        if (last || *std::max_element(error.begin(), error.end()) <= aim) {
          record_.summary.stop = "passes spent";
          break;
        }
      }
      if (!split(error, largest)) {
        if (!look) finish();
        record_.summary.stop = "budget spent";
        break;
      }
    }
    if (record_.boundaryError.max <= options_.tolerance) record_.summary.stop = "tolerance reached";
    record_.charge = totalCharge(mesh_, density_);
    record_.summary.device = device_ && device_->works() ? device_->name() : "cpu";
    record_.summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return {std::move(mesh_), std::move(surface_), std::move(density_), std::move(record_)};
  }

 private:
  void solve() {
    surface_ = std::make_shared<const AlignedSurface>(mesh_, axes_, context_);
    equation_.emplace(surface_, options_.neighbours, context_);
    if (++record_.summary.passes > 1) record_.accuracy = options_.residual;
    iterate();
  }

  void iterate() {
    // One vertex among many hardly shows in the norm, but its error does in what is split next. Not below
    // what the sums can tell.
    const double largest = std::max(0.1 * options_.tolerance, 3 * options_.residual) / largestRadius_;
    const LayerSolution solution = equation_->solve(density_,
                                                    {.residual = record_.accuracy,
                                                     .largestResidual = largest,
                                                     .maxIterations = options_.maxIterations,
                                                     .device = device_},
                                                    context_);
    record_.summary.iterations += static_cast<int>(solution.residualHistory.size());
    record_.summary.residualHistory = solution.residualHistory;
    record_.summary.residual = solution.residual;
    if (!solution.converged) {
      const Vec3 place =
          shape_.frame().toWorld(mesh_.vertices[static_cast<std::size_t>(solution.worstVertex)]);
      throw Error(
          Errc::notConverged,
          "the Green's function did not converge: residual " + formatHistory(solution.residualHistory) +
              ", largest near " + formatPoint(place) +
              "; the mesh probably has needles or nearly touching sheets there: remesh it more evenly");
    }
    density_ = solution.density;
    greenAtTargets_ = solution.green;
  }

  // The largest rho |G| of each triangle, as far as it matters: at corners and centroid, where the equation
  // looks and where it comes for free; and where that is not small, at all samples.
  std::vector<double> likelyError() {
    measureHarmonicRadius();
    const std::size_t n = mesh_.vertices.size();
    std::vector<double> error(mesh_.triangles.size());
    std::vector<char> look(error.size());
    for (std::size_t t = 0; t < error.size(); ++t) {
      double green = std::abs(greenAtTargets_[n + t]);
      for (const std::int32_t v : mesh_.triangles[t]) green = std::max(green, std::abs(greenAtTargets_[v]));
      error[t] = record_.harmonicRadius * green;
      // The largest of all samples is seldom more than twice this.
      look[t] = error[t] > 0.4 * options_.tolerance && error[t] < options_.tolerance;
    }
    measureTriangles(
        surface_->mesh, look,
        [&](std::span<const Vec3> points, std::span<double> h) { sumPotential(points, h); },
        record_.harmonicRadius, error);
    return error;
  }

  // Potential of the layer at points of the surface, or at the center.
  void sumPotential(std::span<const Vec3> points, std::span<double> h) {
    makeSums(surface_->quadrature.places(), points, 0.01 * options_.tolerance, device_)
        ->potential(surface_->quadrature.chargesFor(density_), h, context_);
    surface_->quadrature.addNearPotential(points, surface_->quadrature.near().density(density_), h, context_);
  }

  void measureHarmonicRadius() {
    const Vec3 center = Vec3::Zero();
    double h = 0;
    sumPotential({&center, 1}, {&h, 1});
    record_.harmonicRadius = -1 / h;
  }

  void measure() {
    measureHarmonicRadius();
    measured_ = measureBoundary(
        surface_->mesh, [&](std::span<const Vec3> points, std::span<double> h) { sumPotential(points, h); },
        record_.harmonicRadius);
    measured_.error.worst = axes_.transpose() * measured_.error.worst;
    record_.boundaryError = measured_.error;
  }

  // Where G rises slowly from the surface, at sharp convex edges and in narrow parts, an error within the
  // tolerance may exceed G itself as deep as the shape's triangles are wide, and field lines would follow the
  // error. Counts errors there as larger: the tolerance then stands for kShare of G at that depth.
  void weighByFlux(std::vector<double>& error) const {
    constexpr double kShare = 0.05, kMostWeight = 50;
    for (std::size_t t = 0; t < error.size(); ++t) {
      const Triangle& c = mesh_.triangles[t];
      const double slope = 4 * std::numbers::pi / 3 * (density_[c[0]] + density_[c[1]] + density_[c[2]]);
      const double allowed = kShare * record_.harmonicRadius * std::abs(slope) * width_[t];
      error[t] *= std::clamp(options_.tolerance / allowed, 1.0, kMostWeight);
    }
  }

  // Halves triangles until the error that is expected of their pieces, which falls like their diameter, is
  // within the tolerance; false when the budget does not allow it.
  bool split(std::vector<double> error, double largest) {
    constexpr double kGain = 0.7071;  // of the error by one bisection
    constexpr int kRounds = 8;
    // Expectations far ahead waste vertices, and early passes are cheap.
    constexpr std::size_t kGrowth = 3;
    // At reentrant creases and corners the density is singular, and errors fall more slowly: what is larger
    // than was expected counts as by so much larger again, but for chance.
    constexpr double kSlowest = 4;
    // What is close to the tolerance would miss it next time; and whatever is split at all is split well
    // below it, since a pass costs more than the vertices that it adds.
    const double worthSplitting = 0.8 * options_.tolerance;
    double goal = (record_.summary.passes > 1 ? 0.5 : 0.7) * options_.tolerance;
    const double before = *std::max_element(error.begin(), error.end());
    for (std::size_t t = 0; t < error.size(); ++t) {
      if (error[t] < worthSplitting)
        error[t] = 0;
      else if (!expected_.empty() && expected_[t] > 0)
        error[t] *= std::clamp(error[t] / expected_[t], 1.0, kSlowest);
    }
    std::vector<double>& expected = expected_;
    expected = std::move(error);
    const std::size_t enough = kGrowth * mesh_.vertices.size();
    int round = 0;
    while (round < kRounds && mesh_.vertices.size() < enough) {
      std::vector<char> marked(mesh_.triangles.size());
      for (std::size_t t = 0; t < marked.size(); ++t) marked[t] = expected[t] > goal;
      if (std::find(marked.begin(), marked.end(), 1) == marked.end()) break;
      Refinement refined = bisectLongestEdges(mesh_, marked);
      if (static_cast<double>(refined.mesh.vertices.size()) > largest) {
        goal *= 1.2;  // what is left of the budget goes where the error is largest
        continue;
      }
      for (const auto& [a, b] : refined.parents) density_.push_back(0.5 * (density_[a] + density_[b]));
      std::vector<double> finer(refined.mesh.triangles.size()), width(finer.size());
      for (std::size_t t = 0; t < finer.size(); ++t) {
        const std::uint32_t parent = refined.triangleParents[t];
        // Pieces of one triangle lie side by side.
        const bool cut = (t > 0 && refined.triangleParents[t - 1] == parent) ||
                         (t + 1 < finer.size() && refined.triangleParents[t + 1] == parent);
        finer[t] = (cut ? kGain : 1) * expected[parent];
        width[t] = width_[parent];
      }
      expected = std::move(finer);
      width_ = std::move(width);
      mesh_ = std::move(refined.mesh);
      ++round;
    }
    if (round == 0) return false;
    context_.log(LogLevel::debug, "boundary error " + std::to_string(before) + ": layer split to " +
                                      std::to_string(mesh_.vertices.size()) + " vertices");
    return true;
  }

  // To the residual that was asked for, or the smaller one that narrow parts need: along them the density
  // falls exponentially, and with it what the potential must be exact to.
  void finish() {
    constexpr double kFinest = 1e-10;  // what the sums of the highest order can tell apart
    constexpr int kAttempts = 3;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const double needed = std::min(options_.residual, std::max(kFinest, 0.1 * kNoise * smallestFlux()));
      // What is needed moves a little with the density: that is not worth another round.
      if (needed >= (record_.accuracy > options_.residual ? 1 : 0.5) * record_.accuracy) break;
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
      const double area = surface_->quadrature.area(t);
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
  std::vector<double> width_;  // of the shape's triangle that each is a piece of
  double largestRadius_ = 0;   // of the surface; the harmonic radius is smaller
  Mat3 axes_;
  std::vector<double> density_;
  std::shared_ptr<const AlignedSurface> surface_;  // of mesh_
  std::optional<LayerEquation> equation_;
  std::vector<double> greenAtTargets_;
  std::vector<double> expected_;  // error of each triangle, when it was split; 0: no matter
  MeasuredBoundary measured_;
  std::shared_ptr<PairDevice> device_;
  GreenRecord record_;
};

}  // namespace

SolvedLayer solveAdaptively(const StarShape& shape, const GreenOptions& options, Context& context) {
  return LayerRun(shape, options, context).run();
}

}  // namespace polestar::detail
