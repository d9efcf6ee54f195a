#include "polestar/sphere/column_descent.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/shifted_laplacian.h"
#include "polestar/sphere/detail/sphere_descent.h"
#include "polestar/sphere/detail/sphere_quality.h"

namespace polestar {
namespace {

using detail::Laplacian;
using detail::parallelChunks;

constexpr std::size_t kChunk = 2048;
/// Of the edges' weights in the preconditioner: the determinant resists about as much as the edges do.
constexpr double kStiffness = 2;
/// Least share of a vertex' weights in its shift: more than the factorization rounds.
constexpr double kLeastShift = 1e-9;

struct Column {
  double determinant, squaredSum;  // D and the bracket
  std::array<Vec3, 3> side;        // opposite to corner k, from corner k + 1 to k + 2
};

Column columnAt(const Triangle& t, const ColumnEnergy& energy, std::span<const Vec3> p) {
  Column column;
  for (int k = 0; k < 3; ++k) column.side[k] = p[t[(k + 2) % 3]] - p[t[(k + 1) % 3]];
  // By differences, which tiny triangles keep their digits in.
  column.determinant = p[t[0]].dot(column.side[2].cross(-column.side[1]));
  column.squaredSum = energy.constant;
  for (int k = 0; k < 3; ++k) column.squaredSum += energy.edge[k] * column.side[k].squaredNorm();
  return column;
}

class ColumnSum final : public detail::SphereEnergy {
 public:
  ColumnSum(const std::vector<Triangle>& triangles, std::span<const ColumnEnergy> energies,
            std::span<const Vec3> start)
      : triangles_(triangles), energies_(energies), cornerGradient_(3 * triangles.size()) {
    listCorners(start.size());
    factorize(start);
  }

  double evaluate(std::span<const Vec3> points, std::span<Vec3> gradient) const override {
    const bool wanted = !gradient.empty();
    const double energy = detail::reduceChunks(
        triangles_.size(), kChunk, 0.0,
        [&](std::size_t begin, std::size_t end) {
          double sum = 0;
          for (std::size_t t = begin; t < end; ++t) sum += evaluateOne(t, points, wanted);
          return sum;
        },
        [](double a, double b) { return a + b; });
    if (!wanted || !std::isfinite(energy)) return energy;
    parallelChunks(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        gradient[i].setZero();
        for (std::size_t e = cornerStart_[i]; e < cornerStart_[i + 1]; ++e)
          gradient[i] += cornerGradient_[corners_[e]];
      }
    });
    return energy;
  }

  void precondition(std::span<const Vec3> gradient, std::span<Vec3> out) const override {
    preconditioner_->solve(gradient, out);
  }

 private:
  double evaluateOne(std::size_t t, std::span<const Vec3> points, bool withGradient) const {
    const ColumnEnergy& energy = energies_[t];
    const Triangle& triangle = triangles_[t];
    const Column column = columnAt(triangle, energy, points);
    if (!(column.determinant > 0)) return std::numeric_limits<double>::infinity();
    const double root = std::cbrt(column.determinant), power = 1 / (root * root);
    const double logarithm = std::log(column.determinant) + energy.logOffset;
    if (withGradient) {
      const double byDeterminant =
          (-2.0 / 3 * column.squaredSum * power + 2 * energy.logWeight * logarithm) / column.determinant;
      for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        // side[l] points from corner m to this one, side[m] from this one to corner l.
        cornerGradient_[3 * t + k] =
            2 * power * (energy.edge[l] * column.side[l] - energy.edge[m] * column.side[m]) +
            byDeterminant * points[triangle[l]].cross(column.side[k]);
      }
    }
    return column.squaredSum * power + energy.logWeight * logarithm * logarithm;
  }

  void listCorners(std::size_t vertices) {
    cornerStart_.assign(vertices + 1, 0);
    for (const Triangle& t : triangles_)
      for (const std::int32_t v : t) ++cornerStart_[v + 1];
    for (std::size_t i = 0; i < vertices; ++i) cornerStart_[i + 1] += cornerStart_[i];
    corners_.resize(cornerStart_.back());
    std::vector<std::size_t> next(cornerStart_.begin(), cornerStart_.end() - 1);
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for (int k = 0; k < 3; ++k) corners_[next[triangles_[t][k]]++] = 3 * t + k;
  }

  // The Hessian of the edges' part on the sphere: what points lose in height by moving cancels the diagonal's
  // excess and leaves a Laplacian.
  void factorize(std::span<const Vec3> start) {
    std::vector<std::tuple<std::int32_t, std::int32_t, double>> entries;
    entries.reserve(6 * triangles_.size());
    std::vector<double> shift(start.size(), 0.0);
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const Column column = columnAt(triangles_[t], energies_[t], start);
      const double power = std::pow(column.determinant, -2.0 / 3);
      for (int k = 0; k < 3; ++k) {
        const std::int32_t i = triangles_[t][(k + 1) % 3], j = triangles_[t][(k + 2) % 3];
        const double weight = 2 * kStiffness * energies_[t].edge[k] * power;
        entries.emplace_back(i, j, weight);
        entries.emplace_back(j, i, weight);
        shift[triangles_[t][k]] += (energies_[t].constant * power + energies_[t].logWeight) / 3;
      }
    }
    std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
      return std::tie(std::get<0>(a), std::get<1>(a)) < std::tie(std::get<0>(b), std::get<1>(b));
    });
    Laplacian laplacian;
    laplacian.rowStart.assign(start.size() + 1, 0);
    std::vector<double> weights(start.size(), 0.0);
    for (std::size_t e = 0; e < entries.size();) {
      const auto [row, column, first] = entries[e];
      double weight = 0;
      for (; e < entries.size() && std::get<0>(entries[e]) == row && std::get<1>(entries[e]) == column; ++e)
        weight += std::get<2>(entries[e]);
      if (!(weight > 0)) continue;  // keeps the matrix definite
      weights[row] += weight;
      ++laplacian.rowStart[row + 1];
      laplacian.column.push_back(column);
      laplacian.weight.push_back(weight);
    }
    for (std::size_t i = 0; i < start.size(); ++i) {
      laplacian.rowStart[i + 1] += laplacian.rowStart[i];
      shift[i] = std::max({shift[i], kLeastShift * weights[i], std::numeric_limits<double>::min()});
    }
    preconditioner_ = std::make_unique<detail::ShiftedLaplacian>(laplacian, shift, start);
  }

  const std::vector<Triangle>& triangles_;
  std::span<const ColumnEnergy> energies_;
  std::vector<std::size_t> cornerStart_, corners_;  ///< of a vertex: numbers 3 triangle + corner
  mutable std::vector<Vec3> cornerGradient_;
  std::unique_ptr<const detail::ShiftedLaplacian> preconditioner_;
};

}  // namespace

ColumnDescentResult descendColumns(const std::vector<Triangle>& triangles,
                                   std::span<const ColumnEnergy> energies, std::vector<Vec3>& directions,
                                   int maxIterations, double tolerance, const Context& context) {
  if (!detail::flippedTriangles(directions, triangles).empty())
    throw Error(Errc::usage, "descendColumns: the start has flipped triangles");
  const ColumnSum energy(triangles, energies, directions);
  ColumnDescentResult result;
  result.before = result.after = energy.evaluate(directions, {});
  // Triangles so thin that rounding turns them over: nothing can be said, nothing is moved.
  if (!std::isfinite(result.before)) return result;
  std::vector<Vec3> moved = directions;
  const detail::DescentResult descent =
      detail::descendOnSpheres(energy, moved, {maxIterations, tolerance}, context);
  if (!detail::flippedTriangles(moved, triangles).empty()) return result;
  directions = std::move(moved);
  result.iterations = descent.iterations;
  result.after = descent.energy;
  result.remaining = descent.remaining;
  return result;
}

}  // namespace polestar
