#include "polestar/green/detail/local_inverse.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "polestar/core/detail/aabb_tree.h"
#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

using Eigen::VectorXd;

// The k nearest vertices to vertex i, itself among them, by distance.
void findNearest(const AabbTree& tree, const std::vector<Vec3>& vertices, std::size_t i, std::size_t k,
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

}  // namespace

LocalInverse::LocalInverse(const std::vector<Vec3>& vertices, const VectorXd& area, int neighbours,
                           const Context& context)
    : neighbours_(std::min<std::size_t>(std::min(neighbours, kMaxNeighbours), vertices.size())) {
  const std::size_t n = vertices.size();
  index_.resize(n * neighbours_);
  weight_.resize(n * neighbours_);
  std::vector<Bounds> points(n);
  for (std::size_t i = 0; i < n; ++i) points[i].include(vertices[i]);
  const AabbTree tree(points);
  parallelChunks(n, 64, context, [&](std::size_t begin, std::size_t end) {
    std::vector<std::pair<double, std::int32_t>> found;
    for (std::size_t i = begin; i < end; ++i) {
      findNearest(tree, vertices, i, neighbours_, area[static_cast<Eigen::Index>(i)], found);
      invert(vertices, area, i, found);
    }
  });
}

void LocalInverse::invert(const std::vector<Vec3>& vertices, const VectorXd& area, std::size_t i,
                          const std::vector<std::pair<double, std::int32_t>>& nearest) {
  // The mean of 1/r over a vertex' own area, as if it were a disk, sets the length that regularizes the
  // diagonal.
  constexpr double kSelf = 0.34;
  using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxNeighbours, kMaxNeighbours>;
  using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxNeighbours, 1>;
  const auto k = static_cast<Eigen::Index>(nearest.size());
  Block kernel(k, k);
  Column unit = Column::Zero(k);
  for (Eigen::Index a = 0; a < k; ++a) {
    const std::int32_t ja = nearest[a].second;
    if (static_cast<std::size_t>(ja) == i) unit[a] = 1;
    for (Eigen::Index b = 0; b <= a; ++b) {
      const std::int32_t jb = nearest[b].second;
      kernel(a, b) = 1 / std::sqrt((vertices[ja] - vertices[jb]).squaredNorm() +
                                   kSelf * kSelf * std::sqrt(area[ja] * area[jb]));
    }
  }
  // Only the lower triangle is read.
  const Column row = kernel.llt().solve(unit);
  for (Eigen::Index a = 0; a < k; ++a) {
    index_[i * neighbours_ + a] = nearest[a].second;
    weight_[i * neighbours_ + a] = row[a];
  }
}

VectorXd LocalInverse::apply(const VectorXd& potential, const VectorXd& area) const {
  VectorXd result(potential.size());
  parallelChunks(static_cast<std::size_t>(potential.size()), 2048, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = 0;
      for (std::size_t e = i * neighbours_; e < (i + 1) * neighbours_; ++e)
        sum += weight_[e] * potential[index_[e]];
      result[static_cast<Eigen::Index>(i)] = sum / area[static_cast<Eigen::Index>(i)];
    }
  });
  return result;
}

}  // namespace polestar::detail
