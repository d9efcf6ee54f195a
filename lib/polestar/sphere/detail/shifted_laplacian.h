#pragma once
// Factorized L + D, L a graph Laplacian and D a positive diagonal: the preconditioner of every descent on the
// sphere.

#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"
#include "polestar/sphere/detail/laplacian.h"

namespace polestar::detail {

class ShiftedLaplacian {
 public:
  /// `shift` is positive, one entry a vertex; `positions` of the vertices guide the elimination order and
  /// nothing else. Cost about O(n^1.5), memory O(n log n).
  /// @throws Error{Errc::notConverged} when the matrix is not numerically positive definite.
  ShiftedLaplacian(const Laplacian& laplacian, std::span<const double> shift,
                   std::span<const Vec3> positions);

  /// out = (L + D)^-1 right, the three components at once: reading the factor is what it costs.
  void solve(std::span<const Vec3> right, std::span<Vec3> out) const;

 private:
  // P (L + D) P^T = F diag F^T with F unit lower triangular, stored by columns.
  std::vector<std::size_t> columnStart_;
  std::vector<std::int32_t> row_;
  std::vector<double> value_;
  std::vector<double> inverseDiagonal_;
  std::vector<std::int32_t> order_;  ///< row of the factor -> vertex
};

}  // namespace polestar::detail
