#include "polestar/sphere/detail/flip_repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <utility>

#include "polestar/sphere/detail/dirichlet.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/shifted_laplacian.h"
#include "polestar/sphere/detail/sphere_descent.h"
#include "polestar/sphere/detail/sphere_quality.h"

namespace polestar::detail {
namespace {

/// Target triangles are fattened until their triangle inequalities hold by this share of the longest side: a
/// needle on the surface need not become an equally thin one on the sphere.
constexpr double kTargetSlack = 1e-3;
constexpr int kUntangleRounds = 80;
constexpr int kStepsPerRound = 20;
constexpr int kPolishSteps = 1000;
constexpr int kDescentRounds = 40, kDescentSteps = 50;
/// Triangles visited by the whole descent: about ten seconds.
constexpr double kDescentWork = 1e8;
/// Distance of a flat triangle's plane from the center below which it is held: corners 70 degrees from its
/// middle.
constexpr double kLowPlane = 0.33;
/// Length of the mean direction that counts as none.
constexpr double kCentered = 1e-11;
/// Share of the energy that a round of the descent has to gain for another one.
constexpr double kDescentGain = 1e-5;
/// Widths, in edges, of the patches around flipped triangles that may move.
constexpr std::array kRepairRings{2, 5, 12};
/// Triangles visited before the untangling is given up: well under a second.
constexpr double kWorkLimit = 4e6;
/// Square of the smallest image of a triangle that unit vectors of doubles can still hold with some digits.
constexpr double kSmallestArea = 1e-26;

/// Half the cotangents (opposite to corners 0, 1, 2) of a fattened triangle, and its area.
struct TargetShape {
  std::array<double, 3> halfCotangent;
  double area;
};

TargetShape targetShape(const TriMesh& mesh, std::size_t t) {
  std::array<double, 3> side;  // opposite to corner k
  for (int k = 0; k < 3; ++k) side[k] = (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, (k + 2) % 3)).norm();
  const double longest = *std::max_element(side.begin(), side.end());
  const double slack = side[0] + side[1] + side[2] - 2 * longest;
  const double added = std::max(0.0, kTargetSlack * longest - slack);
  for (double& s : side) s += added;
  const auto& [a, b, c] = side;
  const double product = (a + b + c) * (a + b - c) * (b + c - a) * (c + a - b);
  TargetShape shape;
  shape.area = 0.25 * std::sqrt(product);
  for (int k = 0; k < 3; ++k) {
    const double p = side[(k + 1) % 3], q = side[(k + 2) % 3];
    shape.halfCotangent[k] = (p * p + q * q - side[k] * side[k]) / (8 * shape.area);
  }
  return shape;
}

/// Half of det[p, q, s]: area of a small spherical triangle, with sign. By differences, in which tiny
/// triangles keep their digits.
double signedArea(const Vec3& p, const Vec3& q, const Vec3& s) { return 0.5 * p.dot((q - p).cross(s - p)); }

/// sum_T A x^2 / chi(y), x = d / A and y = a / A with d the Dirichlet energy, a the signed area and A a fixed
/// reference area of the image of T, over the triangles T with a free vertex. The unknowns are the free
/// vertices alone.
class FlipFreeEnergy final : public SphereEnergy {
 public:
  FlipFreeEnergy(const TriMesh& mesh, std::span<const double> areaShares, const std::vector<char>& isFree,
                 std::span<const Vec3> directions)
      : positions_(directions.begin(), directions.end()) {
    local_.assign(isFree.size(), -1);
    for (std::size_t v = 0; v < isFree.size(); ++v) {
      if (!isFree[v]) {
        fixedCenter_ += areaShares[v] * directions[v];
        continue;
      }
      local_[v] = static_cast<std::int32_t>(free_.size());
      free_.push_back(static_cast<std::int32_t>(v));
      share_.push_back(areaShares[v]);
    }
    collectTerms(mesh, directions);
    if (resolved()) factorize();
  }

  const std::vector<std::int32_t>& freeVertices() const { return free_; }
  std::size_t triangles() const { return terms_.size(); }
  /// A displacement that matters to no triangle, radians.
  double negligible() const {
    double smallest = 1;
    for (const Term& term : terms_) smallest = std::min(smallest, term.area);
    return std::min(1e-10, 1e-4 * std::sqrt(smallest));
  }
  /// Whether the images are large enough for their orientation to mean anything.
  bool resolved() const {
    return std::all_of(terms_.begin(), terms_.end(),
                       [](const Term& term) { return term.area > kSmallestArea; });
  }
  /// 0: the barrier itself.
  void setRegularization(double epsilon) { epsilon_ = epsilon; }
  /// The barrier, with the area of the flat triangle between the images: exactly what is distorted, 1 where
  /// the polyhedron itself has its corners on a sphere. Large triangles are kept from flipping, their planes
  /// from passing the center, by a term of their own.
  void measureFlatTriangles() { epsilon_ = 0, flat_ = true; }

  /// Moves the mean that is pulled to 0.
  void biasCenter(const Vec3& bias) { fixedCenter_ += bias; }

  /// Smallest y: not positive while a triangle is flipped.
  double worstRatio(std::span<const Vec3> points) const {
    double worst = std::numeric_limits<double>::infinity();
    for (const Term& term : terms_) {
      const auto [p, q, s] = corners(term, points);
      worst = std::min(worst, signedArea(p, q, s) / term.area);
    }
    return worst;
  }

  double evaluate(std::span<const Vec3> points, std::span<Vec3> gradient) const override {
    Vec3 center = fixedCenter_;
    for (std::size_t i = 0; i < free_.size(); ++i) center += share_[i] * points[i];
    double energy = DirichletEnergy::kCenterPenalty * center.squaredNorm();
    if (!gradient.empty()) {
      for (std::size_t i = 0; i < free_.size(); ++i) {
        gradient[i] = 2 * DirichletEnergy::kCenterPenalty * share_[i] * center;
      }
    }
    for (const Term& term : terms_) {
      const std::array<Vec3, 3> s = corners(term, points);
      double x = 0;
      for (int k = 0; k < 3; ++k)
        x += 0.5 * term.halfCotangent[k] * (s[(k + 1) % 3] - s[(k + 2) % 3]).squaredNorm();
      x /= term.area;
      double y = signedArea(s[0], s[1], s[2]) / term.area;
      Vec3 normal;
      double byHeight = 0, height = 1;
      if (flat_) {
        if (!(y > 0)) return std::numeric_limits<double>::infinity();
        normal = (s[1] - s[0]).cross(s[2] - s[0]);
        const double length = normal.norm();
        height = y * term.area / (0.5 * length);
        y = 0.5 * length / term.area;
        normal /= length;
        if (const double missing = kLowPlane - height; missing > 0) {
          energy += term.weight * missing * missing / height;
          byHeight = -term.weight * missing / height * (2 + missing / height) / (y * term.area);
        }
      }
      const double root = std::hypot(y, epsilon_);
      const double chi = y > 0 ? 0.5 * (y + root) : 0.5 * epsilon_ * epsilon_ / (root - y);
      if (!(chi > 0)) return std::numeric_limits<double>::infinity();
      energy += term.weight * x / chi;
      if (gradient.empty()) continue;
      const double scale = term.weight / term.area;
      const double byX = scale / chi;
      const double byY = -scale * x / (chi * chi) * (0.5 + 0.5 * y / root);
      for (int k = 0; k < 3; ++k) {
        const std::int32_t i = local_[term.vertices[k]];
        if (i < 0) continue;
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        gradient[i] += byX * (term.halfCotangent[m] * (s[k] - s[l]) + term.halfCotangent[l] * (s[k] - s[m]));
        gradient[i] += 0.5 * byY * (flat_ ? normal : s[l]).cross(s[m] - s[l]);
        if (byHeight != 0) gradient[i] += 0.5 * byHeight * (s[l] - height * normal).cross(s[m] - s[l]);
      }
    }
    return energy;
  }

  void precondition(std::span<const Vec3> gradient, std::span<Vec3> out) const override {
    preconditioner_->solve(gradient, out);
  }

 private:
  struct Term {
    Triangle vertices;
    std::array<double, 3> halfCotangent;
    double area;    ///< reference, on the sphere
    double weight;  ///< share of the surface
  };

  std::array<Vec3, 3> corners(const Term& term, std::span<const Vec3> points) const {
    auto at = [&](std::int32_t v) { return local_[v] < 0 ? positions_[v] : points[local_[v]]; };
    return {at(term.vertices[0]), at(term.vertices[1]), at(term.vertices[2])};
  }

  // The reference area is the target's times the local scale of the map, which flipped neighbours must not
  // cancel.
  void collectTerms(const TriMesh& mesh, std::span<const Vec3> directions) {
    std::vector<double> image(mesh.vertices.size(), 0), surface(mesh.vertices.size(), 0);
    std::vector<TargetShape> shapes(mesh.triangles.size());
    double total = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      shapes[t] = targetShape(mesh, t);
      const double area = std::abs(signedArea(directions[a], directions[b], directions[c]));
      for (const std::int32_t v : mesh.triangles[t]) image[v] += area, surface[v] += shapes[t].area;
      total += shapes[t].area;
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      if (local_[a] < 0 && local_[b] < 0 && local_[c] < 0) continue;
      const double scale = (image[a] / surface[a] + image[b] / surface[b] + image[c] / surface[c]) / 3;
      terms_.push_back(
          {mesh.triangles[t], shapes[t].halfCotangent, shapes[t].area * scale, shapes[t].area / total});
    }
  }

  void factorize() {
    std::map<std::pair<std::int32_t, std::int32_t>, double> entries;
    std::vector<double> shift(free_.size());
    for (std::size_t i = 0; i < free_.size(); ++i) shift[i] = share_[i];
    for (const Term& term : terms_) {
      for (int k = 0; k < 3; ++k) {
        const std::int32_t i = local_[term.vertices[(k + 1) % 3]], j = local_[term.vertices[(k + 2) % 3]];
        // Where the map is conformal the Hessian is twice the Laplacian, scaled.
        const double weight = term.halfCotangent[k] * term.weight / term.area;
        if (i >= 0 && j >= 0) {
          entries[{i, j}] += weight;
          entries[{j, i}] += weight;
        } else if (i >= 0 || j >= 0) {
          shift[std::max(i, j)] += weight;
        }
      }
    }
    std::vector<Vec3> places;
    for (const std::int32_t v : free_) places.push_back(positions_[v]);
    Laplacian laplacian;
    laplacian.rowStart.assign(free_.size() + 1, 0);
    for (const auto& [rowColumn, weight] : entries) {
      ++laplacian.rowStart[rowColumn.first + 1];
      laplacian.column.push_back(rowColumn.second);
      laplacian.weight.push_back(weight);
    }
    std::partial_sum(laplacian.rowStart.begin(), laplacian.rowStart.end(), laplacian.rowStart.begin());
    preconditioner_ = std::make_unique<ShiftedLaplacian>(laplacian, shift, places);
  }

  std::vector<Vec3> positions_;
  std::vector<std::int32_t> local_, free_;  ///< vertex -> unknown or -1; unknown -> vertex
  std::vector<double> share_;
  Vec3 fixedCenter_ = Vec3::Zero();
  std::vector<Term> terms_;
  std::unique_ptr<const ShiftedLaplacian> preconditioner_;
  double epsilon_ = 0;
  bool flat_ = false;
};

std::vector<char> verticesNear(const std::vector<std::int32_t>& triangleIds, int rings, const TriMesh& mesh) {
  std::vector<char> near(mesh.vertices.size(), 0);
  for (const std::int32_t t : triangleIds)
    for (const std::int32_t v : mesh.triangles[t]) near[v] = 1;
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<char> before = near;
    for (const Triangle& t : mesh.triangles) {
      if (before[t[0]] || before[t[1]] || before[t[2]]) near[t[0]] = near[t[1]] = near[t[2]] = 1;
    }
  }
  return near;
}

/// Lowers the regularization until no triangle is flipped. [Garanzha et al. 2021, algorithm 1]
bool untangle(FlipFreeEnergy& energy, std::vector<Vec3>& points, const Context& context) {
  double epsilon = 1;
  auto stepsLeft = static_cast<std::int64_t>(kWorkLimit / static_cast<double>(energy.triangles()));
  double worst = energy.worstRatio(points);
  for (int round = 0; round < kUntangleRounds && stepsLeft > 0 && !(worst > 0); ++round) {
    energy.setRegularization(epsilon);
    const double before = energy.evaluate(points, {});
    const int steps = static_cast<int>(std::min<std::int64_t>(kStepsPerRound, stepsLeft));
    const DescentResult descent =
        descendOnSpheres(energy, points, {.maxIterations = steps, .tolerance = energy.negligible()}, context);
    stepsLeft -= descent.evaluations + 1;
    worst = energy.worstRatio(points);
    const double gain = std::max(0.1, 1 - descent.energy / before);
    const double root = std::hypot(worst, epsilon);
    epsilon *= worst < 0 ? 1 - gain * root / (std::abs(worst) + root) : 1 - gain;
  }
  return worst > 0;
}

}  // namespace

RepairOutcome repairFlips(const TriMesh& mesh, std::span<const double> areaShares, int rings,
                          std::vector<Vec3>& directions, const Context& context) {
  const std::vector<std::int32_t> flipped = flippedTriangles(directions, mesh.triangles);
  FlipFreeEnergy energy(mesh, areaShares, verticesNear(flipped, rings, mesh), directions);
  const std::vector<std::int32_t>& freeVertices = energy.freeVertices();
  if (!energy.resolved()) return {.repaired = false, .crowded = true, .freeVertices = 0};

  std::vector<Vec3> points;
  for (const std::int32_t v : freeVertices) points.push_back(directions[v]);
  if (!untangle(energy, points, context))
    return {.repaired = false, .crowded = false, .freeVertices = freeVertices.size()};
  energy.setRegularization(0);
  const int polishSteps = static_cast<int>(std::clamp(kWorkLimit / static_cast<double>(energy.triangles()),
                                                      20.0, static_cast<double>(kPolishSteps)));
  descendOnSpheres(energy, points, {.maxIterations = polishSteps, .tolerance = energy.negligible()}, context);

  std::vector<Vec3> repaired = directions;
  for (std::size_t i = 0; i < points.size(); ++i) repaired[freeVertices[i]] = points[i];
  if (!flippedTriangles(repaired, mesh.triangles).empty())
    return {.repaired = false, .crowded = false, .freeVertices = freeVertices.size()};
  directions = std::move(repaired);
  return {.repaired = true, .crowded = false, .freeVertices = freeVertices.size()};
}

FlipsTurned turnFlipsBack(const TriMesh& mesh, std::span<const double> areaShares,
                          std::vector<Vec3>& directions,
                          const std::function<void(std::vector<Vec3>&)>& finish, Context& context) {
  FlipsTurned result;
  result.flips = flippedTriangles(directions, mesh.triangles).size();
  if (result.flips == 0) return result;
  for (const int rings : kRepairRings) {
    std::vector<Vec3> candidate = directions;
    const RepairOutcome outcome = repairFlips(mesh, areaShares, rings, candidate, context);
    if (outcome.crowded) {
      result.failure =
          "it shrinks a part of the surface (deep and narrow, or without inner vertices) below what doubles "
          "resolve";
      return result;
    }
    if (outcome.repaired) {
      if (finish) finish(candidate);
      if (flippedTriangles(candidate, mesh.triangles).empty()) {
        directions = std::move(candidate);
        result.freeVertices = outcome.freeVertices;
        context.log(LogLevel::info, "sphere map: " + std::to_string(result.flips) +
                                        " flipped triangles were turned back, " +
                                        std::to_string(result.freeVertices) + " vertices were free to move");
        return result;
      }
    }
    if (outcome.freeVertices == mesh.vertices.size()) break;
  }
  result.failure = std::to_string(result.flips) + " of " + std::to_string(mesh.triangles.size()) +
                   " triangles are flipped and could not be turned back";
  return result;
}

void descendFlipFree(const TriMesh& mesh, std::span<const double> areaShares, std::vector<Vec3>& directions,
                     const Context& context) {
  const std::vector<char> all(mesh.vertices.size(), 1);
  double last = std::numeric_limits<double>::infinity();
  Vec3 bias = Vec3::Zero();
  const auto affordable = static_cast<int>(kDescentWork / static_cast<double>(mesh.triangles.size() + 1));
  const int rounds = std::clamp(affordable / kDescentSteps, 4, kDescentRounds);
  for (int round = 0; round < rounds; ++round) {
    // Anew from where it stands: what is stiff depends on the sizes of the images.
    FlipFreeEnergy energy(mesh, areaShares, all, directions);
    if (!energy.resolved()) return;
    energy.measureFlatTriangles();
    energy.biasCenter(bias);
    std::vector<Vec3> moved = directions;
    const DescentResult descent = descendOnSpheres(
        energy, moved, {.maxIterations = kDescentSteps, .tolerance = energy.negligible()}, context);
    // Rounding can turn over what the barrier holds by less than rounding.
    if (!flippedTriangles(moved, mesh.triangles).empty()) return;
    directions = std::move(moved);
    Vec3 center = Vec3::Zero();
    for (std::size_t i = 0; i < directions.size(); ++i) center += areaShares[i] * directions[i];
    const bool still = descent.converged || !(descent.energy < (1 - kDescentGain) * last);
    if (still && center.norm() < kCentered) return;
    // A penalty alone leaves the mean where it balances the energy. [Hestenes 1969, multipliers]
    bias += center;
    last = still ? std::numeric_limits<double>::infinity() : descent.energy;
  }
}

}  // namespace polestar::detail
