#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/green/detail/device_sums.h"
#include "polestar/green/detail/layer_field.h"

namespace polestar::detail {
namespace {

using Eigen::VectorXd;

constexpr std::size_t kBlock = 32;

struct SparseRows {
  std::vector<std::size_t> start{0};
  std::vector<LayerQuadrature::Entry> entries;
};

// The discrete equation. Unknowns: density at the vertices. The potential is taken at vertices and centroids
// and tested against the hat functions by the rule with weights 1/12 a corner and 3/4 at the centroid, which
// is exact for quadratic integrands; the lumped areas scale it back to a potential per vertex, so that
// residuals mean rho |G|.
class LayerEquation {
 public:
  LayerEquation(const TriMesh& mesh, const LayerQuadrature& quadrature,
                const std::shared_ptr<PairDevice>& device, const Context& context)
      : quadrature_(quadrature), targets_(mesh.vertices), charges_(quadrature.emptyCharges()) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      targets_.push_back((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3);
    }
    lumpedArea_ = VectorXd::Zero(mesh.vertices.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) lumpedArea_[mesh.triangles[t][k]] += quadrature.area(t) / 3;
    }
    far_ = makePotentialSums(device, charges_, targets_);
    assembleNearField(context);
  }

  const VectorXd& lumpedArea() const { return lumpedArea_; }

  VectorXd apply(const VectorXd& density, const Context& context) {
    quadrature_.chargesFor({density.data(), static_cast<std::size_t>(density.size())}, charges_);
    VectorXd potential(targets_.size());
    far_->potential(charges_.charge, {potential.data(), targets_.size()}, context);
    parallelChunks(targets_.size(), kBlock, context, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        for (std::size_t e = near_.start[i]; e < near_.start[i + 1]; ++e) {
          potential[i] += near_.entries[e].coefficient * density[near_.entries[e].vertex];
        }
      }
    });
    return test(potential);
  }

  VectorXd rightHandSide() const {
    VectorXd pole(targets_.size());
    for (std::size_t i = 0; i < targets_.size(); ++i) pole[i] = -1 / targets_[i].norm();
    return test(pole);
  }

 private:
  VectorXd test(const VectorXd& potential) const {
    const std::size_t n = quadrature_.vertexCount();
    VectorXd moment = VectorXd::Zero(n);
    for (std::size_t t = 0; t < quadrature_.triangleCount(); ++t) {
      const double area = quadrature_.area(t);
      for (const std::int32_t v : quadrature_.corners(t)) {
        moment[v] += area / 12 * potential[v] + area / 4 * potential[n + t];
      }
    }
    return moment.cwiseQuotient(lumpedArea_);
  }

  void assembleNearField(const Context& context) {
    const std::size_t chunks = (targets_.size() + kBlock - 1) / kBlock;
    std::vector<SparseRows> parts(chunks);
    parallelChunks(targets_.size(), kBlock, context, [&](std::size_t begin, std::size_t end) {
      SparseRows& rows = parts[begin / kBlock];
      for (std::size_t i = begin; i < end; ++i) {
        quadrature_.nearRow(targets_[i], rows.entries);
        rows.start.push_back(rows.entries.size());
      }
    });
    for (const SparseRows& part : parts) {
      const std::size_t base = near_.entries.size();
      near_.entries.insert(near_.entries.end(), part.entries.begin(), part.entries.end());
      for (std::size_t i = 1; i < part.start.size(); ++i) near_.start.push_back(base + part.start[i]);
    }
  }

  const LayerQuadrature& quadrature_;
  std::vector<Vec3> targets_;  // vertices, then centroids
  PointCharges charges_;
  std::unique_ptr<PotentialSums> far_;
  VectorXd lumpedArea_;
  SparseRows near_;
};

// Row i approximates row i of the inverse by that of the kernel among the nearest vertices alone: the
// operator's high frequencies are local, and they are what spoils the conditioning of a first-kind equation.
class LocalInverse {
 public:
  LocalInverse(const std::vector<Vec3>& vertices, const VectorXd& area, int neighbours,
               const Context& context) {
    const std::size_t n = vertices.size(), k = std::min<std::size_t>(neighbours, n);
    index_.resize(n * k);
    weight_.resize(n * k);
    std::vector<Bounds> points(n);
    for (std::size_t i = 0; i < n; ++i) points[i].include(vertices[i]);
    const AabbTree tree(points);
    parallelChunks(n, kBlock, context, [&](std::size_t begin, std::size_t end) {
      std::vector<std::pair<double, std::int32_t>> found;
      for (std::size_t i = begin; i < end; ++i) {
        nearest(tree, vertices, i, k, area[i], found);
        invert(vertices, area, i, found, k);
      }
    });
    neighbours_ = k;
  }

  VectorXd apply(const VectorXd& residual, const VectorXd& area) const {
    VectorXd result(residual.size());
    parallelChunks(static_cast<std::size_t>(residual.size()), 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        double sum = 0;
        for (std::size_t e = i * neighbours_; e < (i + 1) * neighbours_; ++e)
          sum += weight_[e] * residual[index_[e]];
        result[i] = sum / area[i];
      }
    });
    return result;
  }

 private:
  static void nearest(const AabbTree& tree, const std::vector<Vec3>& vertices, std::size_t i, std::size_t k,
                      double area, std::vector<std::pair<double, std::int32_t>>& found) {
    // On a regular mesh the first radius holds about 1.3 k vertices.
    for (double squaredRadius = 0.4 * area * static_cast<double>(k);; squaredRadius *= 2) {
      found.clear();
      tree.visitWithin(vertices[i], squaredRadius, [&](std::size_t j) {
        const double d = (vertices[j] - vertices[i]).squaredNorm();
        if (d <= squaredRadius) found.emplace_back(d, static_cast<std::int32_t>(j));
        return false;
      });
      if (found.size() >= k) break;
    }
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(k), found.end());
    found.resize(k);
  }

  void invert(const std::vector<Vec3>& vertices, const VectorXd& area, std::size_t i,
              const std::vector<std::pair<double, std::int32_t>>& found, std::size_t k) {
    // The mean of 1/r over a vertex' own area, as if it were a disk, sets the length that regularizes the
    // diagonal.
    constexpr double kSelf = 0.34;
    Eigen::MatrixXd kernel(k, k);
    Eigen::Index self = 0;
    for (std::size_t a = 0; a < k; ++a) {
      const std::int32_t ja = found[a].second;
      if (static_cast<std::size_t>(ja) == i) self = static_cast<Eigen::Index>(a);
      for (std::size_t b = 0; b < k; ++b) {
        const std::int32_t jb = found[b].second;
        kernel(a, b) = 1 / std::sqrt((vertices[ja] - vertices[jb]).squaredNorm() +
                                     kSelf * kSelf * std::sqrt(area[ja] * area[jb]));
      }
    }
    const VectorXd row = kernel.llt().solve(VectorXd::Unit(static_cast<Eigen::Index>(k), self));
    for (std::size_t a = 0; a < k; ++a) {
      index_[i * k + a] = found[a].second;
      weight_[i * k + a] = row[static_cast<Eigen::Index>(a)];
    }
  }

  std::size_t neighbours_ = 0;
  std::vector<std::int32_t> index_;
  std::vector<double> weight_;
};

std::string formatHistory(const std::vector<double>& history) {
  std::string text;
  char number[32];
  for (std::size_t i = 0; i < history.size(); i += std::max<std::size_t>(1, history.size() / 8)) {
    std::snprintf(number, sizeof number, "%s%zu:%.1e", text.empty() ? "" : " ", i + 1, history[i]);
    text += number;
  }
  return text;
}

}  // namespace

LayerSolution solveLayer(const TriMesh& mesh, const LayerQuadrature& quadrature,
                         const std::vector<double>& initial, const GreenOptions& options,
                         const std::shared_ptr<PairDevice>& device, Context& context) {
  LayerEquation equation(mesh, quadrature, device, context);
  const LocalInverse inverse(mesh.vertices, equation.lumpedArea(), options.neighbours, context);

  // Right-preconditioned GMRES without restarts, Givens rotations on the fly. [Saad & Schultz 1986]
  const int maxIterations = options.maxIterations;
  VectorXd rest = equation.rightHandSide();
  const double scale = rest.norm();  // residuals are relative to the right-hand side, wherever we start from
  VectorXd density = VectorXd::Zero(rest.size());
  if (!initial.empty()) {
    density = Eigen::Map<const VectorXd>(initial.data(), static_cast<Eigen::Index>(initial.size()));
    rest -= equation.apply(density, context);
  }
  std::vector<VectorXd> basis{rest.normalized()}, directions;
  Eigen::MatrixXd hessenberg = Eigen::MatrixXd::Zero(maxIterations + 1, maxIterations);
  VectorXd cosine(maxIterations), sine(maxIterations), projected = VectorXd::Zero(maxIterations + 1);
  projected[0] = rest.norm();

  LayerSolution solution;
  double residual = rest.norm() / scale;
  const double first = residual;
  int k = 0;
  while (k < maxIterations && residual > options.residual) {
    directions.push_back(inverse.apply(basis[k], equation.lumpedArea()));
    VectorXd w = equation.apply(directions[k], context);
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
    residual = std::abs(projected[k]) / scale;
    solution.residualHistory.push_back(residual);
    if (!(length > 0)) break;
    basis.push_back(w / length);
    context.progress("solving for the Green's function",
                     std::clamp(std::log(residual / first) / std::log(options.residual / first), 0.0, 1.0));
  }
  const VectorXd y = hessenberg.topLeftCorner(k, k).triangularView<Eigen::Upper>().solve(projected.head(k));
  for (int j = 0; j < k; ++j) density += y[j] * directions[j];
  solution.density.assign(density.data(), density.data() + density.size());
  if (!(residual <= options.residual)) {
    throw Error(
        Errc::notConverged,
        "the Green's function did not converge: residual " + formatHistory(solution.residualHistory) +
            " after " + std::to_string(k) +
            " iterations; the mesh probably has needles or nearly touching sheets: remesh it more evenly");
  }
  return solution;
}

}  // namespace polestar::detail
