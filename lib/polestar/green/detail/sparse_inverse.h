#pragma once
// Preconditioner of the single layer's first-kind equation.

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/types.h"

namespace polestar::detail {

/// The inverse of a kernel matrix as L L^T with a sparse L. [Schaefer, Katzfuss & Owhadi 2021, "Sparse
/// Cholesky factorization by Kullback-Leibler minimization"]
///
/// The kernel, 1/sqrt(|x_i - x_j|^2 + kPair^2 sqrt(a_i a_j)) and 1/(kSelf sqrt(a_i)) on the diagonal, a the
/// areas, stands for hat functions tested by hat functions: positive definite, its two numbers those with
/// which GMRES needs the fewest steps on closed meshes.
///
/// Vertices are ordered from coarse to fine. Column i of L holds vertex i and the nearest of those before it,
/// with the coefficients that are the best for this pattern: those of the inverse among them alone. That
/// takes a third fewer steps of GMRES than inverses among neighbours on the finest scale, half as many where
/// they are many. A few smooth functions stay badly scaled, the more the finer the mesh; coarse corrections
/// by cluster means cost more steps than they saved. Memory: 24 bytes an entry of L. Time: vertices times
/// neighbours cubed.
class SparseInverse {
 public:
  static constexpr int kMaxNeighbours = 64;
  static constexpr double kSelf = 0.55, kPair = 0.6;

  /// @param area of the surface around each vertex.
  /// @param neighbours entries of a column, the vertex itself among them
  SparseInverse(const std::vector<Vec3>& vertices, const Eigen::VectorXd& area, int neighbours,
                const Context& context);
  /// From potentials at the vertices to charges. The same bytes for any number of threads.
  Eigen::VectorXd apply(const Eigen::VectorXd& potential) const;

 private:
  void transpose();

  std::size_t size_ = 0;  // entries of a column
  std::vector<std::int32_t> vertex_;
  std::vector<double> value_;
  // The same by rows.
  std::vector<std::size_t> rowStart_;
  std::vector<std::int32_t> column_;
  std::vector<double> byRow_;
};

}  // namespace polestar::detail
