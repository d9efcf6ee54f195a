#include "polestar/green/detail/svd_least_squares.h"

#include <Eigen/Householder>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"

namespace polestar::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using MatrixRef = Eigen::Ref<MatrixXd>;
using ConstMatrixRef = Eigen::Ref<const MatrixXd>;
using ConstVectorRef = Eigen::Ref<const VectorXd>;

constexpr Index kQrPanel = 64, kBidiagonalPanel = 32;  // columns that are eliminated before the rest follows
constexpr std::size_t kColumns = 128, kRows = 256;     // of a parallel chunk

// A^T v and A u, by chunks of fixed size.
VectorXd transposedTimes(const ConstMatrixRef& a, const ConstVectorRef& v, const Context& context) {
  VectorXd result(a.cols());
  parallelChunks(static_cast<std::size_t>(a.cols()), kColumns, context,
                 [&](std::size_t begin, std::size_t end) {
                   const auto first = static_cast<Index>(begin), count = static_cast<Index>(end - begin);
                   result.segment(first, count).noalias() = a.middleCols(first, count).transpose() * v;
                 });
  return result;
}

VectorXd times(const ConstMatrixRef& a, const ConstVectorRef& u, const Context& context) {
  VectorXd result(a.rows());
  parallelChunks(static_cast<std::size_t>(a.rows()), kRows, context, [&](std::size_t begin, std::size_t end) {
    const auto first = static_cast<Index>(begin), count = static_cast<Index>(end - begin);
    result.segment(first, count).noalias() = a.middleRows(first, count) * u;
  });
  return result;
}

// Brings (matrix | rightHandSide) to (R | Q^T rightHandSide); below R stays rubbish.
void triangularize(MatrixXd& matrix, VectorXd& rightHandSide, const std::string& stage,
                   const Context& context) {
  const Index rows = matrix.rows(), columns = matrix.cols();
  for (Index begin = 0; begin < columns; begin += kQrPanel) {
    context.progress(stage, 0.5 * static_cast<double>(begin) / static_cast<double>(columns));
    const Index width = std::min(kQrPanel, columns - begin), height = rows - begin;
    const Eigen::HouseholderQR<MatrixXd> panel(matrix.block(begin, begin, height, width));
    matrix.block(begin, begin, width, width) = panel.matrixQR().topRows(width).triangularView<Eigen::Upper>();
    const auto reflections = panel.householderQ().setLength(width).adjoint();
    rightHandSide.tail(height).applyOnTheLeft(reflections);
    const Index rest = begin + width;
    parallelChunks(static_cast<std::size_t>(columns - rest), kColumns, context,
                   [&](std::size_t b, std::size_t e) {
                     matrix.block(begin, rest + static_cast<Index>(b), height, static_cast<Index>(e - b))
                         .applyOnTheLeft(reflections);
                   });
  }
}

// The smaller singular value of the triangle (f g; 0 h), without over- and underflow. [LAPACK's dlas2]
double smallerSingularValue(double f, double g, double h) {
  const double fa = std::abs(f), ga = std::abs(g), ha = std::abs(h);
  const double low = std::min(fa, ha), high = std::max(fa, ha);
  if (low == 0) return 0;
  if (ga < high) {
    const double as = 1 + low / high, at = (high - low) / high, au = (ga / high) * (ga / high);
    return low * 2 / (std::sqrt(as * as + au) + std::sqrt(at * at + au));
  }
  const double au = high / ga;
  if (au == 0) return low * high / ga;
  const double as = 1 + low / high, at = (high - low) / high;
  return 2 * low * au / (std::sqrt(1 + (as * au) * (as * au)) + std::sqrt(1 + (at * au) * (at * au)));
}

}  // namespace

SvdLeastSquares::SvdLeastSquares(MatrixXd matrix, const VectorXd& rightHandSide, const std::string& stage,
                                 const Context& context)
    : rightHandSide_(rightHandSide) {
  const Index columns = matrix.cols();
  triangularize(matrix, rightHandSide_, stage, context);
  rightHandSide_.conservativeResize(columns);
  reflectors_ = matrix.topRows(columns).triangularView<Eigen::Upper>();
  matrix.resize(0, 0);
  bidiagonalize(stage, context);
  diagonalize(context);
}

double SvdLeastSquares::peakBytes(double rows, double columns) {
  // While R is copied out of A; and R with the rotations: about 0.9 columns^2, of two numbers each.
  return 8 * std::max(rows * columns + columns * columns, 2.8 * columns * columns);
}

// Reflections from the left and from the right in turn, gathered over a panel: within it the matrix stands
// for
//     A - V Y^T - X U^T,
// so that the rest is read twice a column but written once a panel. [Dongarra, Sorensen & Hammarling 1989;
// LAPACK's dlabrd]
void SvdLeastSquares::bidiagonalize(const std::string& stage, const Context& context) {
  const Index size = reflectors_.cols();
  diagonal_ = superdiagonal_ = reflectorScales_ = VectorXd::Zero(size);
  for (Index begin = 0; begin < size; begin += kBidiagonalPanel) {
    const double done = std::pow(1 - static_cast<double>(begin) / static_cast<double>(size), 3);
    context.progress(stage, 1 - 0.5 * done);
    const Index width = std::min(kBidiagonalPanel, size - begin), n = size - begin;
    auto a = reflectors_.bottomRightCorner(n, n);
    auto b = rightHandSide_.tail(n);
    MatrixXd v = MatrixXd::Zero(n, width), y = v, x = v, u = v;
    for (Index j = 0; j < width; ++j) {
      const Index below = n - j - 1;
      auto column = a.col(j).tail(n - j);
      column -= v.block(j, 0, n - j, j) * y.row(j).head(j).transpose() +
                x.block(j, 0, n - j, j) * u.row(j).head(j).transpose();
      double scale;
      column.makeHouseholderInPlace(scale, diagonal_[begin + j]);
      v(j, j) = 1;
      v.col(j).tail(below) = column.tail(below);
      const auto reflector = v.col(j).tail(n - j);
      b.tail(n - j) -= scale * reflector.dot(b.tail(n - j)) * reflector;
      if (below == 0) break;

      y.col(j).tail(below) =
          scale * (transposedTimes(a.block(j, j + 1, n - j, below), reflector, context) -
                   y.block(j + 1, 0, below, j) * (v.block(j, 0, n - j, j).transpose() * reflector) -
                   u.block(j + 1, 0, below, j) * (x.block(j, 0, n - j, j).transpose() * reflector));
      VectorXd row = a.row(j).tail(below).transpose() -
                     y.block(j + 1, 0, below, j + 1) * v.row(j).head(j + 1).transpose() -
                     u.block(j + 1, 0, below, j) * x.row(j).head(j).transpose();
      row.makeHouseholderInPlace(scale, superdiagonal_[begin + j]);
      row[0] = 1;
      u.col(j).tail(below) = row;
      column.tail(below) = row;  // its own entries are in v
      reflectorScales_[begin + j] = scale;
      x.col(j).tail(below) =
          scale * (times(a.block(j + 1, j + 1, below, below), row, context) -
                   v.block(j + 1, 0, below, j + 1) * (y.block(j + 1, 0, below, j + 1).transpose() * row) -
                   x.block(j + 1, 0, below, j) * (u.block(j + 1, 0, below, j).transpose() * row));
    }
    const Index rest = n - width;
    parallelChunks(
        static_cast<std::size_t>(rest), kColumns, context, [&](std::size_t first, std::size_t end) {
          const Index from = width + static_cast<Index>(first), count = static_cast<Index>(end - first);
          auto block = a.block(width, from, rest, count);
          block.noalias() -= v.bottomRows(rest) * y.middleRows(from, count).transpose();
          block.noalias() -= x.bottomRows(rest) * u.middleRows(from, count).transpose();
        });
  }
}

// One sweep of implicit QR down the rows first .. last, after LAPACK's dbdsqr.
void SvdLeastSquares::sweep(Index first, Index last, double shift) {
  Sweep record{first, rotations_.size(), 0};
  VectorXd &d = diagonal_, &e = superdiagonal_, &b = rightHandSide_;
  double f = d[first], g = e[first];
  if (shift > 0) f = (std::abs(d[first]) - shift) * (std::copysign(1.0, d[first]) + shift / d[first]);
  Eigen::JacobiRotation<double> rotation;
  for (Index i = first; i < last; ++i) {
    // From the right: moves the entry above the diagonal to below it. makeGivens has the sine's other sign.
    double length;
    rotation.makeGivens(f, g, &length);
    double c = rotation.c(), s = -rotation.s();
    rotations_.push_back({c, s});
    if (i > first) e[i - 1] = length;
    f = c * d[i] + s * e[i];
    e[i] = c * e[i] - s * d[i];
    g = s * d[i + 1];
    d[i + 1] *= c;
    // From the left: and from there to one row further down.
    rotation.makeGivens(f, g, &d[i]);
    c = rotation.c(), s = -rotation.s();
    f = c * e[i] + s * d[i + 1];
    d[i + 1] = c * d[i + 1] - s * e[i];
    if (i + 1 < last) {
      g = s * e[i + 1];
      e[i + 1] *= c;
    }
    const double upper = b[i];
    b[i] = c * upper + s * b[i + 1];
    b[i + 1] = c * b[i + 1] - s * upper;
  }
  e[last - 1] = f;
  record.end = rotations_.size();
  sweeps_.push_back(record);
}

void SvdLeastSquares::diagonalize(const Context& context) {
  const Index size = columns();
  const double norm = std::max(diagonal_.cwiseAbs().maxCoeff(), superdiagonal_.cwiseAbs().maxCoeff());
  // Absolute: singular values below rounding errors of the largest will count as 0 anyway.
  const double negligible = std::numeric_limits<double>::epsilon() * norm;
  Index last = size - 1;
  const Index limit = 40 * size;  // two sweeps a value are usual
  for (Index count = 0; last > 0; ++count) {
    context.throwIfCancelled();
    if (count > limit || !std::isfinite(norm)) {
      throw Error(Errc::notConverged, "the singular value decomposition did not converge");
    }
    while (last > 0 && std::abs(superdiagonal_[last - 1]) <= negligible) --last;
    if (last == 0) break;
    Index first = last - 1;
    while (first > 0 && std::abs(superdiagonal_[first - 1]) > negligible) --first;
    double shift = smallerSingularValue(diagonal_[last - 1], superdiagonal_[last - 1], diagonal_[last]);
    const double ratio = shift / std::abs(diagonal_[first]);
    if (!(ratio * ratio > std::numeric_limits<double>::epsilon())) shift = 0;
    sweep(first, last, shift);
  }
}

VectorXd SvdLeastSquares::singularValues() const {
  VectorXd values = diagonal_.cwiseAbs();
  std::sort(values.begin(), values.end(), std::greater<>());
  return values;
}

Index SvdLeastSquares::rank(double cutoff) const {
  const VectorXd values = diagonal_.cwiseAbs();
  return (values.array() > cutoff * values.maxCoeff()).count();
}

VectorXd SvdLeastSquares::solve(double cutoff) const {
  const double smallest = cutoff * diagonal_.cwiseAbs().maxCoeff();
  VectorXd x(columns());
  for (Index i = 0; i < columns(); ++i) {
    x[i] = std::abs(diagonal_[i]) > smallest ? rightHandSide_[i] / diagonal_[i] : 0;
  }
  for (std::size_t k = sweeps_.size(); k-- > 0;) {
    Index i = sweeps_[k].first + static_cast<Index>(sweeps_[k].end - sweeps_[k].begin);
    for (std::size_t r = sweeps_[k].end; r-- > sweeps_[k].begin;) {
      --i;
      const auto [c, s] = rotations_[r];
      const double upper = x[i];
      x[i] = c * upper - s * x[i + 1];
      x[i + 1] = s * upper + c * x[i + 1];
    }
  }
  for (Index j = columns() - 1; j-- > 0;) {
    const auto reflector = reflectors_.col(j).tail(columns() - j - 1);
    x.tail(columns() - j - 1) -= reflectorScales_[j] * reflector.dot(x.tail(columns() - j - 1)) * reflector;
  }
  return x;
}

}  // namespace polestar::detail
