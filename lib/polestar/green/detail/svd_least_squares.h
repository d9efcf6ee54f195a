#pragma once
// Dense least squares by the singular value decomposition: what the paper solves its charges with.
//
// Householder QR, bidiagonalization of R and implicit QR on the bidiagonal matrix [Golub & Van Loan, ch.
// 8.6], specialized to one right-hand side: of the singular vectors only the reflections and rotations are
// kept that make them up, which saves two thirds of the work. Eigen's and LAPACK's routines can neither be
// cancelled nor be held to the same bytes for any number of threads; these can.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "polestar/core/context.h"

namespace polestar::detail {

/// Minimizes |A x - b| for dense A with at least as many rows as columns, for any number of cutoffs.
class SvdLeastSquares {
 public:
  /// Decomposes `matrix` in place. Time O(rows columns^2), checks for cancellation many times a second.
  /// `stage` is what Context::progress shows.
  /// @throws Error{Errc::notConverged} for infinities and NaNs.
  SvdLeastSquares(Eigen::MatrixXd matrix, const Eigen::VectorXd& rightHandSide, const std::string& stage,
                  const Context& context);

  /// What a decomposition takes of memory at its peak, the matrix included.
  static double peakBytes(double rows, double columns);

  Eigen::Index columns() const { return diagonal_.size(); }
  /// Descending.
  Eigen::VectorXd singularValues() const;
  /// How many singular values exceed `cutoff` times the largest.
  Eigen::Index rank(double cutoff) const;
  /// The shortest x of least residual when singular values up to `cutoff` times the largest count as 0.
  /// O(columns^2).
  Eigen::VectorXd solve(double cutoff) const;

 private:
  struct Rotation {
    double cosine, sine;
  };
  struct Sweep {  // rotations of the pairs (first, first + 1), (first + 1, first + 2) ...
    Eigen::Index first;
    std::size_t begin, end;
  };
  void bidiagonalize(const std::string& stage, const Context& context);
  void diagonalize(const Context& context);
  void sweep(Eigen::Index first, Eigen::Index last, double shift);

  // Column j below its diagonal holds right reflector j, which begins with a 1 at row j + 1.
  Eigen::MatrixXd reflectors_;
  Eigen::VectorXd reflectorScales_;
  // The bidiagonal matrix; in the end the diagonal holds the singular values, with signs.
  Eigen::VectorXd diagonal_, superdiagonal_;
  Eigen::VectorXd rightHandSide_;    // turned along
  std::vector<Rotation> rotations_;  // of the right singular vectors
  std::vector<Sweep> sweeps_;
};

}  // namespace polestar::detail
