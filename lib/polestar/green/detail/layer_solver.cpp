#include <tbb/enumerable_thread_specific.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "polestar/core/detail/parallel.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/green/detail/sparse_inverse.h"

namespace polestar::detail {
namespace {

using Eigen::VectorXd;

// Accuracy of the sums in inner iterations, and how far those reduce a residual before it is computed anew
// with better sums: what the cheap sums cannot tell apart is not worth iterating for.
constexpr double kInnerAccuracy = 3e-5, kInnerReduction = 1e-3;

std::span<const double> view(const VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

// Rows of the near field, in the order in which they were made.
struct NearRows {
  std::vector<std::uint32_t> target;
  std::vector<std::size_t> start{0};
  std::vector<std::int32_t> vertex;
  std::vector<double> coefficient;
};

// Sums the triangles' shares of each vertex. One a thread; keeps a place for every vertex of the mesh.
class RowCollector {
 public:
  explicit RowCollector(const LayerQuadrature& quadrature)
      : quadrature_(quadrature), lastRow_(quadrature.vertexCount(), 0), place_(quadrature.vertexCount()) {}

  void append(std::uint32_t target, const Vec3& x, const NearCandidates& candidates, NearRows& rows) {
    found_.clear();
    quadrature_.near().appendRows(x, candidates, found_);
    ++row_;
    for (const NearField::Row& triangle : found_) {
      for (int k = 0; k < 3; ++k) {
        const std::int32_t v = quadrature_.corners(triangle.triangle)[k];
        if (lastRow_[v] != row_) {
          lastRow_[v] = row_;
          place_[v] = rows.vertex.size();
          rows.vertex.push_back(v);
          rows.coefficient.push_back(0);
        }
        rows.coefficient[place_[v]] += triangle.coefficient[k];
      }
    }
    rows.target.push_back(target);
    rows.start.push_back(rows.vertex.size());
  }

 private:
  const LayerQuadrature& quadrature_;
  std::uint32_t row_ = 0;
  std::vector<std::uint32_t> lastRow_;  // in which each vertex has an entry
  std::vector<std::size_t> place_;      // of that entry
  std::vector<NearField::Row> found_;
};

}  // namespace

// Unknowns: density at the vertices. The potential is taken at vertices and centroids and tested against the
// hat functions by the rule with weights 1/12 a corner and 3/4 at the centroid, which is exact for quadratic
// integrands; the lumped areas scale it back to a potential per vertex, so that residuals mean rho |G|.
struct LayerEquation::Data {
  std::shared_ptr<const AlignedSurface> surface;
  std::vector<Vec3> targets;  // vertices, then centroids
  VectorXd lumpedArea;
  std::vector<NearRows> near;
  std::unique_ptr<const SparseInverse> inverse;

  const LayerQuadrature& quadrature() const { return surface->quadrature; }

  VectorXd test(const VectorXd& potential) const {
    const std::size_t n = quadrature().vertexCount();
    VectorXd moment = VectorXd::Zero(static_cast<Eigen::Index>(n));
    for (std::size_t t = 0; t < quadrature().triangleCount(); ++t) {
      const double area = quadrature().area(t);
      const double center = area / 4 * potential[static_cast<Eigen::Index>(n + t)];
      for (const std::int32_t v : quadrature().corners(t)) moment[v] += area / 12 * potential[v] + center;
    }
    return moment.cwiseQuotient(lumpedArea);
  }

  // At the targets.
  VectorXd potential(const VectorXd& density, const PotentialSums& sums, const Context& context) const {
    VectorXd potential(static_cast<Eigen::Index>(targets.size()));
    sums.potential(quadrature().chargesFor(view(density)), {potential.data(), targets.size()}, context);
    parallelChunks(near.size(), 1, context, [&](std::size_t c, std::size_t) {
      const NearRows& rows = near[c];
      for (std::size_t i = 0; i < rows.target.size(); ++i) {
        double sum = 0;
        for (std::size_t e = rows.start[i]; e < rows.start[i + 1]; ++e)
          sum += rows.coefficient[e] * density[rows.vertex[e]];
        potential[rows.target[i]] += sum;
      }
    });
    return potential;
  }

  // 1/|x| at the targets.
  VectorXd pole() const {
    VectorXd pole(static_cast<Eigen::Index>(targets.size()));
    for (std::size_t i = 0; i < targets.size(); ++i)
      pole[static_cast<Eigen::Index>(i)] = 1 / targets[i].norm();
    return pole;
  }

  void assembleNear(const Context& context) {
    const NearIndex& index = quadrature().nearIndex();
    std::vector<std::pair<std::uint32_t, std::uint32_t>> leafOf(targets.size());
    parallelChunks(targets.size(), 4096, context, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        leafOf[i] = {index.locate(targets[i]), static_cast<std::uint32_t>(i)};
    });
    std::sort(leafOf.begin(), leafOf.end());
    constexpr std::size_t kChunk = 512;
    near.resize((targets.size() + kChunk - 1) / kChunk);
    tbb::enumerable_thread_specific<RowCollector> collectors([&] { return RowCollector(quadrature()); });
    parallelChunks(targets.size(), kChunk, context, [&](std::size_t begin, std::size_t end) {
      NearRows& rows = near[begin / kChunk];
      RowCollector& collector = collectors.local();
      NearCandidates candidates;
      for (std::size_t i = begin; i < end; ++i) {
        if (i == begin || leafOf[i].first != leafOf[i - 1].first)
          candidates.assign(quadrature().near(), index.candidates(leafOf[i].first));
        collector.append(leafOf[i].second, targets[leafOf[i].second], candidates, rows);
      }
      rows.vertex.shrink_to_fit();
      rows.coefficient.shrink_to_fit();
    });
  }

  // Right-preconditioned GMRES without restarts, Givens rotations on the fly, for a correction that reduces
  // `rest` to `goal`. [Saad & Schultz 1986]
  VectorXd correct(const VectorXd& rest, double goal, double scale, const PotentialSums& sums,
                   const LayerSolveOptions& options, LayerSolution& solution, Context& context) const {
    const int most = std::max(1, options.maxIterations - static_cast<int>(solution.residualHistory.size()));
    std::vector<VectorXd> basis{rest.normalized()}, directions;
    Eigen::MatrixXd hessenberg = Eigen::MatrixXd::Zero(most + 1, most);
    VectorXd cosine(most), sine(most), projected = VectorXd::Zero(most + 1);
    projected[0] = rest.norm();
    int k = 0;
    while (k < most && std::abs(projected[k]) > goal) {
      directions.push_back(inverse->apply(basis[k]).cwiseQuotient(lumpedArea));
      VectorXd w = test(potential(directions[k], sums, context));
      for (int j = 0; j <= k; ++j) {
        hessenberg(j, k) = w.dot(basis[j]);
        w -= hessenberg(j, k) * basis[j];
      }
      const double length = w.norm();
      hessenberg(k + 1, k) = length;
      for (int j = 0; j < k; ++j) {
        const double upper = hessenberg(j, k), lower = hessenberg(j + 1, k);
        hessenberg(j, k) = cosine[j] * upper + sine[j] * lower;
        hessenberg(j + 1, k) = -sine[j] * upper + cosine[j] * lower;
      }
      const double radius = std::hypot(hessenberg(k, k), hessenberg(k + 1, k));
      cosine[k] = hessenberg(k, k) / radius;
      sine[k] = hessenberg(k + 1, k) / radius;
      hessenberg(k, k) = radius;
      hessenberg(k + 1, k) = 0;
      projected[k + 1] = -sine[k] * projected[k];
      projected[k] *= cosine[k];
      ++k;
      solution.residualHistory.push_back(std::abs(projected[k]) / scale);
      context.progress(
          "solving for the Green's function",
          std::clamp(std::log(std::max(solution.residualHistory.back(), 1e-300)) / std::log(options.residual),
                     0.0, 1.0));
      if (!(length > 0)) break;
      basis.push_back(w / length);
    }
    const VectorXd y = hessenberg.topLeftCorner(k, k).triangularView<Eigen::Upper>().solve(projected.head(k));
    VectorXd correction = VectorXd::Zero(rest.size());
    for (int j = 0; j < k; ++j) correction += y[j] * directions[j];
    return correction;
  }
};

LayerEquation::LayerEquation(std::shared_ptr<const AlignedSurface> surface, int neighbours, Context& context)
    : data_(std::make_unique<Data>()) {
  Data& d = *data_;
  d.surface = std::move(surface);
  const TriMesh& mesh = d.surface->mesh;
  d.targets = mesh.vertices;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    d.targets.push_back((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3);
  d.lumpedArea = VectorXd::Zero(static_cast<Eigen::Index>(mesh.vertices.size()));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::int32_t v : mesh.triangles[t]) d.lumpedArea[v] += d.quadrature().area(t) / 3;
  }
  d.assembleNear(context);
  d.inverse = std::make_unique<const SparseInverse>(mesh.vertices, d.lumpedArea, neighbours, context);
}

LayerEquation::~LayerEquation() = default;

LayerSolution LayerEquation::solve(const std::vector<double>& initial, const LayerSolveOptions& options,
                                   Context& context) const {
  const Data& d = *data_;
  const auto [cheap, exact] =
      makeSums(d.quadrature().places(), d.targets, std::max(kInnerAccuracy, options.residual),
               0.3 * options.residual, options.device);
  VectorXd green = d.pole();                  // at the targets
  const double scale = d.test(green).norm();  // residuals are relative to it, wherever we start from
  LayerSolution solution;
  VectorXd density = VectorXd::Zero(d.lumpedArea.size());
  if (!initial.empty()) {
    density = Eigen::Map<const VectorXd>(initial.data(), static_cast<Eigen::Index>(initial.size()));
    green += d.potential(density, *exact, context);
  }
  VectorXd rest = -d.test(green);
  // By how much it has to be reduced: at most 1 when it is small enough.
  auto excess = [&] {
    return std::max(rest.norm() / (options.residual * scale),
                    rest.lpNorm<Eigen::Infinity>() / options.largestResidual);
  };
  for (double left = excess();;) {
    solution.residual = rest.norm() / scale;
    solution.converged = left <= 1;
    if (solution.converged || static_cast<int>(solution.residualHistory.size()) >= options.maxIterations)
      break;
    const double goal = rest.norm() * std::max(0.5 / left, kInnerReduction);
    density += d.correct(rest, goal, scale, *cheap, options, solution, context);
    green = d.pole() + d.potential(density, *exact, context);
    rest = -d.test(green);
    const double reached = excess();
    // Refinement that no longer helps has met the accuracy of the sums.
    const bool stalled = !(reached <= 1 || reached < 0.5 * left);  // also when it is no number
    left = reached;
    if (stalled) break;
  }
  solution.residual = rest.norm() / scale;
  rest.cwiseAbs().maxCoeff(&solution.worstVertex);
  solution.density.assign(density.data(), density.data() + density.size());
  solution.green.assign(green.data(), green.data() + green.size());
  return solution;
}

}  // namespace polestar::detail
