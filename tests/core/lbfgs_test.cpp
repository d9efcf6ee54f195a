#include "polestar/core/detail/lbfgs.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/QR>
#include <limits>

namespace polestar::detail {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// Symmetric, eigenvalues from 1 to 1000.
Matrix stiff(int n) {
  const Matrix turn = Matrix::Random(n, n).householderQr().householderQ();
  return turn *
         Vector::LinSpaced(n, 0, 3).unaryExpr([](double e) { return std::pow(10.0, e); }).asDiagonal() *
         turn.transpose();
}

const auto kNone = [](const Vector& q, const auto&) -> Vector { return q; };

TEST(LimitedMemory, IsBfgsWhileNothingIsForgotten) {
  // The formula for the inverse Hessian, dense, beside it.
  const int n = 6;
  std::srand(1);
  const Matrix hessian = stiff(n);
  LimitedMemory<Vector> memory(100);
  Matrix inverse = 0.3 * Matrix::Identity(n, n);
  for (int k = 0; k < 10; ++k) {
    const Vector step = Vector::Random(n), change = hessian * step;
    const Matrix project = Matrix::Identity(n, n) - step * change.transpose() / step.dot(change);
    inverse = project * inverse * project.transpose() + step * step.transpose() / step.dot(change);
    memory.remember(step, change);
    const Vector gradient = Vector::Random(n);
    const Vector applied = memory.applyTo(gradient, [](const Vector& q) -> Vector { return 0.3 * q; });
    EXPECT_LT((applied - inverse * gradient).norm(), 1e-9 * gradient.norm()) << k;
    // The last pair is met exactly.
    EXPECT_LT((memory.applyTo(change, [](const Vector& q) -> Vector { return 0.3 * q; }) - step).norm(),
              1e-9);
  }
}

TEST(LimitedMemory, ForgetsTheOldestAndRefusesWhatCurvesDown) {
  LimitedMemory<Vector> memory(2);
  const auto unit = [](int k) -> Vector { return Vector::Unit(4, k); };
  const auto applied = [&](int k) {
    return memory.applyTo(unit(k), [](const Vector& q) -> Vector { return q; })[k];
  };
  EXPECT_FALSE(memory.oldestScale());
  memory.remember(unit(0), -unit(0));
  memory.remember(unit(0), 0 * unit(0));
  EXPECT_TRUE(memory.empty());
  for (int k = 0; k < 3; ++k) memory.remember(unit(k), (k + 2.0) * unit(k));
  EXPECT_DOUBLE_EQ(applied(0), 1);
  EXPECT_DOUBLE_EQ(applied(1), 1.0 / 3);
  EXPECT_DOUBLE_EQ(applied(2), 1.0 / 4);
  EXPECT_DOUBLE_EQ(*memory.oldestScale(), 1.0 / 3);
  memory.carrySteps([](Vector& step) { step.setZero(); });
  EXPECT_DOUBLE_EQ(applied(2), 1) << "steps of length 0 correct nothing";
  memory.clear();
  EXPECT_TRUE(memory.empty());
}

TEST(DescendLbfgs, FindsTheMinimumOfAQuadratic) {
  std::srand(2);
  const Matrix hessian = stiff(20);
  const Vector goal = Vector::Random(20);
  int evaluations = 0;
  const auto evaluate = [&](const Vector& x, Vector& gradient) {
    ++evaluations;
    gradient = hessian * (x - goal);
    return 0.5 * (x - goal).dot(gradient);
  };
  Vector x = Vector::Zero(20);
  descendLbfgs(x, {.steps = 1000, .memory = 20, .gain = 0}, evaluate,
               [](const Vector& q, const LimitedMemory<Vector>& memory) -> Vector {
                 return memory.oldestScale().value_or(1e-3) * q;
               });
  EXPECT_LT((x - goal).norm(), 1e-6);
  // With the inverse Hessian for a preconditioner one step is all.
  const Eigen::LDLT<Matrix> factors(hessian);
  x.setZero();
  evaluations = 0;
  descendLbfgs(x, {.steps = 1, .memory = 8}, evaluate,
               [&](const Vector& q, const auto&) -> Vector { return factors.solve(q); });
  EXPECT_LT((x - goal).norm(), 1e-10);
  EXPECT_EQ(evaluations, 2);
}

TEST(DescendLbfgs, FollowsRosenbrocksValley) {
  Eigen::Vector2d x(-1.2, 1);
  const double end = descendLbfgs(
      x, {.steps = 200, .gain = 0},
      [](const Eigen::Vector2d& p, Eigen::Vector2d& gradient) {
        const double a = 1 - p[0], b = p[1] - p[0] * p[0];
        gradient = {-2 * a - 400 * p[0] * b, 200 * b};
        return a * a + 100 * b * b;
      },
      [](const Eigen::Vector2d& q, const auto&) -> Eigen::Vector2d { return 1e-3 * q; });
  EXPECT_LT((x - Eigen::Vector2d(1, 1)).norm(), 1e-6);
  EXPECT_LT(end, 1e-12);
}

TEST(DescendLbfgs, StaysWhereTheValueIsFiniteAndNeverRises) {
  // x - ln x, infinite from 0 down: the first full step would end there.
  Vector x = Vector::Constant(1, 10);
  std::vector<double> values;
  const double end = descendLbfgs(
      x, {.steps = 100, .gain = 0},
      [&](const Vector& p, Vector& gradient) {
        if (!(p[0] > 0)) return std::numeric_limits<double>::infinity();
        gradient[0] = 1 - 1 / p[0];
        values.push_back(p[0] - std::log(p[0]));
        return values.back();
      },
      [](const Vector& q, const auto&) -> Vector { return 50 * q; });
  EXPECT_NEAR(x[0], 1, 1e-7);
  EXPECT_EQ(end, *std::min_element(values.begin(), values.end()));
}

TEST(DescendLbfgs, KeepsToItsLimits) {
  const auto slope = [](const Vector& p, Vector& gradient) {
    gradient = Vector::Constant(1, -1);
    return -p[0];
  };
  Vector x = Vector::Zero(1);
  // A slope without an end: steps as long as allowed, as many as allowed.
  descendLbfgs(x, {.steps = 7, .gain = 0, .longest = 0.5}, slope,
               [](const Vector& q, const auto&) -> Vector { return 100 * q; });
  EXPECT_DOUBLE_EQ(x[0], 3.5);
  // An ascent direction is no step at all.
  x.setZero();
  descendLbfgs(x, {.steps = 7}, slope, [](const Vector& q, const auto&) -> Vector { return -q; });
  EXPECT_EQ(x[0], 0);
  // A gain of less than was asked for is the last.
  x.setOnes();
  descendLbfgs(x, {.steps = 7, .gain = 0.9, .longest = 1}, slope, kNone);
  EXPECT_DOUBLE_EQ(x[0], 2);
}

}  // namespace
}  // namespace polestar::detail
