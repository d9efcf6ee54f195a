#pragma once
// Factorized L + D, L a graph Laplacian and D a positive diagonal: the preconditioner of every descent on the
// sphere.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/nested_dissection.h"

namespace polestar::detail {

/// Cholesky factor by parts of a nested dissection: every separator is eliminated as a dense block with what
/// its halves left of it, halves at the same time. [Duff, Reid 1983, multifrontal method]
class ShiftedLaplacian {
 public:
  /// `shift` is positive, one entry a vertex; `positions` of the vertices guide the elimination order and
  /// nothing else. Cost about O(n^1.5), memory O(n log n). The same for any number of threads.
  /// @throws Error{Errc::notConverged} when the matrix is not numerically positive definite.
  ShiftedLaplacian(const Laplacian& laplacian, std::span<const double> shift,
                   std::span<const Vec3> positions);

  /// out = (L + D)^-1 right, the three components at once: reading the factor is what it costs.
  void solve(std::span<const Vec3> right, std::span<Vec3> out) const;

 private:
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  /// Factor of the columns that a part eliminates.
  struct Block {
    std::vector<std::int32_t> below;  ///< rows that follow the block's own, ascending
    Eigen::MatrixXd values;           ///< own rows (lower triangle), then those below
  };
  class Factorization;

  /// Own rows of `x` become those of F^-1 x; returns what is to be added to the rows below.
  Columns forward(std::int32_t part, Columns& x) const;
  void backward(std::int32_t part, Columns& x) const;

  Elimination elimination_;
  std::vector<Block> blocks_;  ///< of the parts
};

}  // namespace polestar::detail
