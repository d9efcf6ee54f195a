#include "polestar/sphere/detail/shifted_laplacian.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>

#include "polestar/core/error.h"
#include "polestar/sphere/detail/nested_dissection.h"

namespace polestar::detail {

ShiftedLaplacian::ShiftedLaplacian(const Laplacian& laplacian, std::span<const double> shift,
                                   std::span<const Vec3> positions)
    : order_(nestedDissection(laplacian, positions)) {
  using Matrix = Eigen::SparseMatrix<double>;
  const auto n = static_cast<Eigen::Index>(order_.size());
  std::vector<std::int32_t> place(order_.size());
  for (std::size_t row = 0; row < order_.size(); ++row) place[order_[row]] = static_cast<std::int32_t>(row);

  // The upper triangle by columns: what an up-looking factorization reads.
  Matrix upper(n, n);
  upper.reserve(n + static_cast<Eigen::Index>(laplacian.column.size() / 2));
  std::vector<std::pair<std::int32_t, double>> column;
  for (Eigen::Index c = 0; c < n; ++c) {
    const std::int32_t vertex = order_[c];
    double diagonal = shift[vertex];
    column.clear();
    for (std::size_t e = laplacian.rowStart[vertex]; e < laplacian.rowStart[vertex + 1]; ++e) {
      diagonal += laplacian.weight[e];
      const std::int32_t row = place[laplacian.column[e]];
      if (row < c) column.emplace_back(row, -laplacian.weight[e]);
    }
    std::sort(column.begin(), column.end());
    upper.startVec(c);
    for (const auto& [row, value] : column) upper.insertBack(row, c) = value;
    upper.insertBack(c, c) = diagonal;
  }
  upper.finalize();

  const Eigen::SimplicialLDLT<Matrix, Eigen::Upper, Eigen::NaturalOrdering<int>> factorization(upper);
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
}

void ShiftedLaplacian::solve(std::span<const Vec3> right, std::span<Vec3> out) const {
  const std::size_t n = order_.size();
  std::vector<Vec3> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = right[order_[i]];
  for (std::size_t c = 0; c < n; ++c) {
    const Vec3 pivot = x[c];
    for (std::size_t e = columnStart_[c]; e < columnStart_[c + 1]; ++e) x[row_[e]] -= value_[e] * pivot;
  }
  for (std::size_t c = n; c-- > 0;) {
    Vec3 sum = inverseDiagonal_[c] * x[c];
    for (std::size_t e = columnStart_[c]; e < columnStart_[c + 1]; ++e) sum -= value_[e] * x[row_[e]];
    x[c] = sum;
  }
  for (std::size_t i = 0; i < n; ++i) out[order_[i]] = x[i];
}

}  // namespace polestar::detail
