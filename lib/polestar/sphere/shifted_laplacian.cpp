#include "polestar/sphere/detail/shifted_laplacian.h"

#include <Eigen/SparseCholesky>

#include "polestar/core/error.h"

namespace polestar::detail {

ShiftedLaplacian::ShiftedLaplacian(const Laplacian& laplacian, std::span<const double> shift) {
  using Matrix = Eigen::SparseMatrix<double>;
  const auto n = static_cast<Eigen::Index>(laplacian.size());
  Matrix lower(n, n);
  Eigen::VectorXi perColumn(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    perColumn[i] = 1 + static_cast<int>(laplacian.rowStart[i + 1] - laplacian.rowStart[i]);
  }
  lower.reserve(perColumn);
  for (Eigen::Index i = 0; i < n; ++i) {
    double diagonal = shift[i];
    for (std::size_t e = laplacian.rowStart[i]; e < laplacian.rowStart[i + 1]; ++e)
      diagonal += laplacian.weight[e];
    lower.insert(i, i) = diagonal;
    for (std::size_t e = laplacian.rowStart[i]; e < laplacian.rowStart[i + 1]; ++e) {
      if (laplacian.column[e] > i) lower.insert(laplacian.column[e], i) = -laplacian.weight[e];
    }
  }
  lower.makeCompressed();

  const Eigen::SimplicialLDLT<Matrix, Eigen::Lower> factorization(lower);
  if (factorization.info() != Eigen::Success || !(factorization.vectorD().minCoeff() > 0)) {
    throw Error(Errc::notConverged,
                "a Laplacian is not positive definite to rounding (triangles of nearly no area)");
  }
  const auto& factor = factorization.matrixL().nestedExpression();
  columnStart_.reserve(n + 1);
  columnStart_.push_back(0);
  row_.reserve(factor.nonZeros());
  value_.reserve(factor.nonZeros());
  for (Eigen::Index c = 0; c < n; ++c) {
    for (Matrix::InnerIterator it(factor, c); it; ++it) {
      if (it.row() <= c) continue;
      row_.push_back(static_cast<std::int32_t>(it.row()));
      value_.push_back(it.value());
    }
    columnStart_.push_back(row_.size());
  }
  const Eigen::VectorXd diagonal = factorization.vectorD();
  for (const double d : diagonal) inverseDiagonal_.push_back(1 / d);
  const auto& indices = factorization.permutationP().indices();
  permutation_.assign(indices.data(), indices.data() + indices.size());
}

void ShiftedLaplacian::solve(std::span<const Vec3> right, std::span<Vec3> out) const {
  const std::size_t n = permutation_.size();
  std::vector<Vec3> x(n);
  for (std::size_t i = 0; i < n; ++i) x[permutation_[i]] = right[i];
  for (std::size_t c = 0; c < n; ++c) {
    const Vec3 pivot = x[c];
    for (std::size_t e = columnStart_[c]; e < columnStart_[c + 1]; ++e) x[row_[e]] -= value_[e] * pivot;
  }
  for (std::size_t c = n; c-- > 0;) {
    Vec3 sum = inverseDiagonal_[c] * x[c];
    for (std::size_t e = columnStart_[c]; e < columnStart_[c + 1]; ++e) sum -= value_[e] * x[row_[e]];
    x[c] = sum;
  }
  for (std::size_t i = 0; i < n; ++i) out[i] = x[permutation_[i]];
}

}  // namespace polestar::detail
