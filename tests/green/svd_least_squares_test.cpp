#include "polestar/green/detail/svd_least_squares.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <limits>
#include <random>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"

namespace polestar::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd randomMatrix(Index rows, Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

SvdLeastSquares decompose(const MatrixXd& matrix, const VectorXd& b) {
  return {matrix, b, "decomposing", Context::quiet()};
}

/// Eigen's one-sided Jacobi method: another algorithm altogether, and the most accurate one there is.
void expectAgreesWithJacobi(const MatrixXd& matrix, const VectorXd& b, double cutoff) {
  Eigen::JacobiSVD<MatrixXd> jacobi(matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  jacobi.setThreshold(cutoff);
  const SvdLeastSquares ours = decompose(matrix, b);
  const double largest = jacobi.singularValues()[0];
  const double rounding = 1e-14 * static_cast<double>(matrix.cols());
  EXPECT_LT((ours.singularValues() - jacobi.singularValues()).cwiseAbs().maxCoeff(), rounding * largest);
  ASSERT_EQ(ours.rank(cutoff), jacobi.rank());
  const VectorXd expected = jacobi.solve(b), x = ours.solve(cutoff);
  const double condition = largest / jacobi.singularValues()[jacobi.rank() - 1];
  EXPECT_LT((x - expected).norm(), rounding * condition * condition * expected.norm())
      << matrix.rows() << " x " << matrix.cols();
}

TEST(SvdLeastSquares, AgreesWithJacobisMethodForAllShapes) {
  // Below, at and above the widths of panels and chunks.
  for (const auto& [rows, columns] : std::initializer_list<std::pair<Index, Index>>{{1, 1},
                                                                                    {2, 1},
                                                                                    {2, 2},
                                                                                    {3, 2},
                                                                                    {7, 5},
                                                                                    {33, 32},
                                                                                    {40, 33},
                                                                                    {64, 64},
                                                                                    {66, 65},
                                                                                    {200, 97},
                                                                                    {300, 150}}) {
    const MatrixXd matrix = randomMatrix(rows, columns, 1);
    expectAgreesWithJacobi(matrix, randomMatrix(rows, 1, 2), 1e-12);
  }
}

TEST(SvdLeastSquares, TakesTheShortestOfManySolutions) {
  MatrixXd matrix = randomMatrix(60, 40, 3);
  matrix.col(7) = matrix.col(30);
  matrix.col(11) = matrix.col(2) - 2 * matrix.col(3);
  matrix.col(39).setZero();
  expectAgreesWithJacobi(matrix, randomMatrix(60, 1, 4), 1e-10);
  expectAgreesWithJacobi(MatrixXd::Constant(9, 6, 0.5), randomMatrix(9, 1, 5), 1e-10);
  EXPECT_EQ(decompose(MatrixXd::Zero(5, 3), VectorXd::Ones(5)).solve(1e-12), VectorXd::Zero(3));
}

TEST(SvdLeastSquares, TruncatesAMatrixWhoseSingularValuesFallWithoutAGap) {
  // Singular values 1, 1/2, 1/4 ... between random orthogonal factors: what charges far from a surface have.
  const Index n = 50;
  const MatrixXd u =
      Eigen::HouseholderQR<MatrixXd>(randomMatrix(80, n, 6)).householderQ() * MatrixXd::Identity(80, n);
  const MatrixXd v =
      Eigen::HouseholderQR<MatrixXd>(randomMatrix(n, n, 7)).householderQ() * MatrixXd::Identity(n, n);
  VectorXd values(n);
  for (Index i = 0; i < n; ++i) values[i] = std::pow(0.5, i);
  const VectorXd b = u * VectorXd::Ones(n);
  const SvdLeastSquares ours = decompose(u * values.asDiagonal() * v.transpose(), b);
  for (const Index kept : {Index{5}, Index{20}, Index{30}}) {
    const double cutoff = 0.7 * values[kept - 1];
    ASSERT_EQ(ours.rank(cutoff), kept);
    const VectorXd expected = v.leftCols(kept) * values.head(kept).cwiseInverse();
    EXPECT_LT((ours.solve(cutoff) - expected).norm(), 1e-13 / values[kept - 1] * expected.norm()) << kept;
  }
}

TEST(SvdLeastSquares, SameBytesForAnyNumberOfThreads) {
  const MatrixXd matrix = randomMatrix(500, 300, 8);
  const VectorXd b = randomMatrix(500, 1, 9);
  VectorXd one, two;
  withThreads(1, [&] { one = decompose(matrix, b).solve(1e-12); });
  withThreads(2, [&] { two = decompose(matrix, b).solve(1e-12); });
  EXPECT_EQ(one, two);
}

TEST(SvdLeastSquares, StopsWhenCancelledInEitherHalf) {
  const MatrixXd matrix = randomMatrix(600, 400, 10);
  for (const double when : {0.1, 0.6}) {
    Context context;
    context.onProgress = [&](std::string_view, double fraction) {
      if (fraction > when) context.cancel();
    };
    try {
      SvdLeastSquares(matrix, VectorXd::Ones(600), "decomposing", context);
      FAIL() << "it ran to its end";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::cancelled);
    }
  }
}

TEST(SvdLeastSquares, RefusesWhatIsNotANumber) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    MatrixXd matrix = randomMatrix(30, 20, 11);
    matrix(17, 5) = bad;
    EXPECT_THROW(decompose(matrix, VectorXd::Ones(30)), Error);
  }
}

}  // namespace
}  // namespace polestar::detail
