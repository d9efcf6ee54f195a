#include "polestar/map/balanced.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "polestar/core/detail/lbfgs.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/sphere/column_descent.h"

namespace polestar {
namespace {

constexpr std::size_t kChunk = 512;  // triangles
constexpr double kStill = 3e-4;      // radians: less than an edge of any mesh
constexpr double kGain = 1e-5;       // of the energy, from a round that others may follow
constexpr int kRadiusSteps = 400;

/// A cell of the foliation, linear functions on it, and what its image has in common with the others of its
/// kind: corners at the outer or the inner end of their line, det of the image = sigma(s, s') D.
struct Cell {
  double volumeTimesSix;
  std::array<int, 4> corner;  ///< of the triangle; -1: the center
  std::array<bool, 4> outer;  ///< at the outer level of the layer
  Eigen::Matrix4d inner;      ///< products of the gradients of the barycentric weights
  int kind;                   ///< number of corners at the outer level, 1 to 3
};

std::optional<Cell> cellAt(const Foliation& f, std::size_t id, std::size_t layer, const Triangle& triangle,
                           double smallest) {
  const auto node = f.cell(id);
  const Vec3& origin = f.nodes[node[0]];
  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = f.nodes[node[k + 1]] - origin;
  Cell cell;
  const Vec3 cross = edges.col(1).cross(edges.col(2));
  cell.volumeTimesSix = edges.col(0).dot(cross);
  if (!(cell.volumeTimesSix > smallest)) return std::nullopt;
  Eigen::Matrix<double, 3, 4> gradient;
  gradient.col(1) = cross / cell.volumeTimesSix;
  gradient.col(2) = edges.col(2).cross(edges.col(0)) / cell.volumeTimesSix;
  gradient.col(3) = edges.col(0).cross(edges.col(1)) / cell.volumeTimesSix;
  gradient.col(0) = -gradient.col(1) - gradient.col(2) - gradient.col(3);
  cell.inner = gradient.transpose() * gradient;

  const std::size_t innerLevel = f.nodeId(layer + 1, 0);
  cell.kind = 0;
  for (int k = 0; k < 4; ++k) {
    cell.outer[k] = node[k] < innerLevel;
    const auto vertex =
        static_cast<std::int32_t>(node[k] - (cell.outer[k] ? f.nodeId(layer, 0) : innerLevel));
    cell.corner[k] = -1;
    if (node[k] == f.centerNode()) continue;
    for (int c = 0; c < 3; ++c) {
      if (triangle[c] == vertex) cell.corner[k] = c;
    }
    cell.kind += cell.outer[k];
  }
  return cell;
}

/// Calls body(layer, cell) for the cells below a triangle, the cone last.
template <class Body>
void visitColumn(const Foliation& f, std::size_t triangle, double smallest, Body&& body) {
  const std::size_t layers = f.layerCount(), triangles = f.triangles.size();
  for (std::size_t layer = 0; layer <= layers; ++layer) {
    const std::size_t first = 3 * layer * triangles + (layer < layers ? 3 * triangle : triangle);
    for (std::size_t id = first; id < first + (layer < layers ? 3 : 1); ++id) {
      if (const std::optional<Cell> cell = cellAt(f, id, layer, f.triangles[triangle], smallest))
        body(layer, *cell);
    }
  }
}

/// Determinant of the image of a cell over that of its triangle's directions: with s at the outer and t at
/// the inner level, (s - t) t^2, (s - t) s t or (s - t) s^2 by the number of outer corners; s^3 for the cone.
double sigma(int outerCorners, double s, double t) {
  switch (outerCorners) {
    case 1:
      return (s - t) * t * t;
    case 2:
      return (s - t) * s * t;
    default:
      return (s - t) * s * s;
  }
}

double power23(double x) {
  const double root = std::cbrt(x);
  return root * root;
}

double determinant(const Vec3& a, const Vec3& b, const Vec3& c) { return a.dot((b - a).cross(c - a)); }

/// One layer at a fixed sphere map, by kind of cell: sum over cells of weight times
/// (outer s^2 + mixed s t + inner t^2) / (3 sigma^(2/3)) and (ln sigma + log)^2.
struct LayerSum {
  double outer = 0, mixed = 0, inner = 0;
  double weight = 0, logSum = 0, logSquares = 0;
};
using LayerSums = std::vector<std::array<LayerSum, 4>>;  // by layer, then kind

LayerSums& operator+=(LayerSums& a, const LayerSums& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t k = 0; k < a[i].size(); ++k) {
      LayerSum& to = a[i][k];
      const LayerSum& from = b[i][k];
      to.outer += from.outer, to.mixed += from.mixed, to.inner += from.inner;
      to.weight += from.weight, to.logSum += from.logSum, to.logSquares += from.logSquares;
    }
  }
  return a;
}

class Balancer {
 public:
  Balancer(const GreenChart& chart, const BalanceOptions& options, const Context& context)
      : foliation_(chart.foliation()), options_(options), context_(context) {
    volume_ = volumeProperties(chart.green().shape().mesh()).volume;
    smallest_ = 1e-16 * volume_;
    // ln of the ratio that det J has where volumes are shared out evenly.
    logEven_ = std::log(4 * std::numbers::pi / 3 / volume_);
    weight_.assign(foliation_.triangles.size(), 1);
    if (chart.report().cells.bad() > 0) weighColumns();
  }

  /// Coefficients of every column at radii `s` of the levels.
  std::vector<ColumnEnergy> columns(std::span<const double> s) const {
    std::vector<ColumnEnergy> energies(foliation_.triangles.size());
    detail::parallelChunks(energies.size(), kChunk, context_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) energies[t] = columnEnergy(t, s);
    });
    return energies;
  }

  LayerSums layers(std::span<const Vec3> phi) const {
    const LayerSums zero(foliation_.layerCount() + 1);
    LayerSums total = detail::reduceChunks(
        foliation_.triangles.size(), kChunk, zero,
        [&](std::size_t begin, std::size_t end) {
          LayerSums part = zero;
          for (std::size_t t = begin; t < end; ++t) addToLayers(t, phi, part);
          return part;
        },
        [](LayerSums a, const LayerSums& b) { return a += b; });
    context_.throwIfCancelled();
    return total;
  }

  /// The energy of radii `s`; its gradient by them where asked for.
  double energy(const LayerSums& sums, std::span<const double> s, std::span<double> gradient) const {
    const std::size_t cone = foliation_.layerCount();
    double total = 0;
    std::fill(gradient.begin(), gradient.end(), 0.0);
    for (std::size_t layer = 0; layer <= cone; ++layer) {
      for (int kind = 0; kind < 4; ++kind) {
        const LayerSum& sum = sums[layer][kind];
        if (!(sum.weight > 0)) continue;
        const double a = s[layer], b = layer < cone ? s[layer + 1] : 0;
        const double image = layer < cone ? sigma(kind, a, b) : a * a * a;
        const double logarithm = std::log(image), mu = options_.volumeWeight;
        const double square = sum.outer * a * a + sum.mixed * a * b + sum.inner * b * b;
        const double power = 1 / (3 * power23(image));
        total += square * power +
                 mu * (sum.weight * logarithm * logarithm + 2 * logarithm * sum.logSum + sum.logSquares);
        if (gradient.empty()) continue;
        const double byLog = -2.0 / 3 * square * power + 2 * mu * (sum.weight * logarithm + sum.logSum);
        // d ln sigma: the difference s - t, then as many outer radii as corners there less one.
        const double byOuter = layer < cone ? 1 / (a - b) + (kind - 1) / a : 3 / a;
        gradient[layer] += power * (2 * sum.outer * a + sum.mixed * b) + byLog * byOuter;
        if (layer < cone) {
          const double byInner = -1 / (a - b) + (3 - kind) / b;
          gradient[layer + 1] += power * (sum.mixed * a + 2 * sum.inner * b) + byLog * byInner;
        }
      }
    }
    return total;
  }

  /// The radii of least energy, from `s`.
  void optimizeRadii(const LayerSums& sums, std::vector<double>& s) const;

 private:
  // Where lines are noise some cells come out inverted and the others misshapen beyond measure: a column with
  // an inverted cell keeps its triangle from flipping and has little else to say.
  void weighColumns() {
    constexpr double kDoubtful = 1e-4;
    const std::size_t whole = 3 * foliation_.layerCount() + 1;
    detail::parallelChunks(weight_.size(), kChunk, context_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        std::size_t cells = 0;
        visitColumn(foliation_, t, smallest_, [&](std::size_t, const Cell&) { ++cells; });
        if (cells < whole) weight_[t] = kDoubtful;
      }
    });
  }

  ColumnEnergy columnEnergy(std::size_t triangle, std::span<const double> s) const {
    ColumnEnergy column;
    double logWeight = 0, logSum = 0;
    visitColumn(foliation_, triangle, smallest_, [&](std::size_t layer, const Cell& cell) {
      const bool cone = layer == foliation_.layerCount();
      const double a = s[layer], b = cone ? 0 : s[layer + 1];
      std::array<double, 4> radius;
      for (int k = 0; k < 4; ++k) radius[k] = cell.corner[k] < 0 ? 0 : cell.outer[k] ? a : b;
      const double scale = (cone ? a * a * a : sigma(cell.kind, a, b)) / cell.volumeTimesSix;
      const double weight = weight_[triangle] * cell.volumeTimesSix / (6 * volume_);
      const double factor = weight / (3 * power23(scale));
      // p_i . p_j = 1 - |p_i - p_j|^2 / 2 turns |J|^2 into lengths of sides, which small triangles keep
      // their digits in.
      const Eigen::Vector4d r(radius[0], radius[1], radius[2], radius[3]);
      column.constant += factor * r.dot(cell.inner * r);
      for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < i; ++j) {
          if (cell.corner[i] < 0 || cell.corner[j] < 0 || cell.corner[i] == cell.corner[j]) continue;
          const int opposite = 3 - cell.corner[i] - cell.corner[j];
          column.edge[opposite] -= factor * cell.inner(i, j) * radius[i] * radius[j];
        }
      }
      logWeight += weight;
      logSum += weight * (std::log(scale) - logEven_);
    });
    column.logWeight = options_.volumeWeight * logWeight;
    column.logOffset = logWeight > 0 ? logSum / logWeight : 0;
    return column;
  }

  void addToLayers(std::size_t triangle, std::span<const Vec3> phi, LayerSums& sums) const {
    std::array<Vec3, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = phi[foliation_.triangles[triangle][k]];
    const double imageOfTriangle = determinant(p[0], p[1], p[2]);
    if (!(imageOfTriangle > 0)) return;
    visitColumn(foliation_, triangle, smallest_, [&](std::size_t layer, const Cell& cell) {
      const double scale = imageOfTriangle / cell.volumeTimesSix;
      const double weight = weight_[triangle] * cell.volumeTimesSix / (6 * volume_);
      const double factor = weight / power23(scale), logarithm = std::log(scale) - logEven_;
      LayerSum& sum = sums[layer][cell.kind];
      for (int i = 0; i < 4; ++i) {
        if (cell.corner[i] < 0) continue;
        for (int j = 0; j < 4; ++j) {
          if (cell.corner[j] < 0) continue;
          const double product =
              factor * cell.inner(i, j) * (1 - 0.5 * (p[cell.corner[i]] - p[cell.corner[j]]).squaredNorm());
          (cell.outer[i] && cell.outer[j]   ? sum.outer
           : cell.outer[i] || cell.outer[j] ? sum.mixed
                                            : sum.inner) += product;
        }
      }
      sum.weight += weight;
      sum.logSum += weight * logarithm;
      sum.logSquares += weight * logarithm * logarithm;
    });
  }

  const Foliation& foliation_;
  const BalanceOptions& options_;
  const Context& context_;
  double volume_, smallest_, logEven_;
  std::vector<double> weight_;  ///< of every column
};

// In the logarithms of the steps between radii, which keep them monotone; only ratios count, so that s = 1 at
// the surface costs nothing. There are few radii, and every step is remembered: BFGS itself.
void Balancer::optimizeRadii(const LayerSums& sums, std::vector<double>& s) const {
  using Vector = Eigen::VectorXd;
  const auto n = static_cast<Eigen::Index>(s.size());
  std::vector<double> radii(s.size()), byRadius(s.size());
  const auto evaluate = [&](const Vector& logSteps, Vector& gradient) {
    double sum = 0;
    for (Eigen::Index k = n; k-- > 0;) radii[k] = sum += std::exp(logSteps[k]);
    double turned = 0;  // derivative by a common factor
    for (double& r : radii) r /= sum;
    const double value = energy(sums, radii, byRadius);
    for (std::size_t k = 0; k < radii.size(); ++k) turned += byRadius[k] * radii[k];
    double within = 0;
    for (Eigen::Index k = 0; k < n; ++k) {
      within += byRadius[k];
      gradient[k] = (within - turned) * std::exp(logSteps[k]) / sum;
    }
    return value;
  };
  // A tenth of a unit along the first gradient, then the curvature of the first step.
  double firstNorm = 0;
  const auto precondition = [&](const Vector& q, const detail::LimitedMemory<Vector>& memory) -> Vector {
    if (firstNorm == 0) firstNorm = std::max(1e-12, q.norm());
    return memory.oldestScale().value_or(0.1 / firstNorm) * q;
  };

  Vector x(n), gradient(n);
  for (Eigen::Index k = 0; k < n; ++k) x[k] = std::log(k + 1 < n ? s[k] - s[k + 1] : s[k]);
  detail::descendLbfgs(x, {.steps = kRadiusSteps, .memory = kRadiusSteps, .gain = 1e-12, .longest = 1},
                       evaluate, precondition);
  evaluate(x, gradient);
  s = radii;
  s.front() = 1;
}

}  // namespace

void BalanceOptions::validate() const {
  if (!(volumeWeight >= 0 && volumeWeight < 1e3))
    throw Error(Errc::usage, "BalanceOptions: volumeWeight must lie in [0, 1000)");
  if (rounds < 0 || stepsPerRound < 1)
    throw Error(Errc::usage, "BalanceOptions: rounds and stepsPerRound count steps");
}

BalancedMap balanceMap(const GreenChart& chart, const SphereMap& start, const RadiusProfile* fixedRadius,
                       const BalanceOptions& options, const Context& context) {
  options.validate();
  const Foliation& f = chart.foliation();
  const Balancer balancer(chart, options, context);
  BalancedMap result{start, fixedRadius ? *fixedRadius : RadiusProfile(), 0, 0};
  std::vector<double> s(f.levels.size());
  for (std::size_t k = 0; k < s.size(); ++k) s[k] = result.radius.value(f.levels[k]);

  std::vector<Vec3> phi = start.directions;
  LayerSums sums = balancer.layers(phi);
  result.before = balancer.energy(sums, s, {});
  if (!fixedRadius) balancer.optimizeRadii(sums, s);
  result.after = balancer.energy(sums, s, {});
  const int rounds = start.flips == 0 ? options.rounds : 0;
  for (int round = 0; round < rounds; ++round) {
    descendColumns(f.triangles, balancer.columns(s), phi, options.stepsPerRound, kStill, context);
    sums = balancer.layers(phi);
    if (!fixedRadius) balancer.optimizeRadii(sums, s);
    const double last = std::exchange(result.after, balancer.energy(sums, s, {}));
    if (!(result.after < last - kGain)) break;
  }

  if (rounds > 0) {
    // The energy does not see rotations: take the one closest to the radial map, as the conformal map does.
    const TriMesh& mesh = chart.green().shape().mesh();
    std::vector<Vec3> radial;
    for (const Vec3& v : mesh.vertices) radial.push_back(v.normalized());
    const Mat3 turn = bestRotation(phi, radial, vertexAreas(mesh));
    for (Vec3& p : phi) p = (turn * p).normalized();
    SphereMap turned = measuredSphereMap(chart.green().shape(), SphereMapKind::balanced, std::move(phi));
    if (turned.flips == 0) {
      result.sphere = std::move(turned);
    } else {
      result.sphere.fallbackReason = std::string("no balanced map: turning it would flip needles; the ") +
                                     toString(start.kind) + " map is used instead";
    }
  }
  if (!fixedRadius) {
    std::vector<RadiusProfile::Knot> knots;
    for (std::size_t k = s.size(); k-- > 0;) knots.push_back({f.levels[k], s[k]});
    result.radius = RadiusProfile(RadiusKind::balanced, std::move(knots));
  }
  return result;
}

}  // namespace polestar
