#include "polestar/sphere/detail/shifted_laplacian.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"

namespace polestar::detail {
namespace {

/// Vertices of a part from which on its halves are worth two tasks.
constexpr std::int32_t kParallel = 2000;

template <class Lower, class Upper>
void inHalves(const Elimination::Part& part, Lower&& lower, Upper&& upper) {
  if (part.lower < 0) return;
  if (part.end - part.first < kParallel) {
    lower();
    upper();
  } else {
    inParallel(lower, upper);
  }
}

/// Where a row goes in a block with the own rows [own, end) and then `below`.
class RowFinder {
 public:
  RowFinder(const Elimination::Part& part, const std::vector<std::int32_t>& below)
      : part_(part), below_(below), own_(part.end - part.own) {}
  /// Rows must be asked for in ascending order.
  Eigen::Index next(std::int32_t row) {
    if (row < part_.end) return row - part_.own;
    while (below_[at_] != row) ++at_;
    return own_ + static_cast<Eigen::Index>(at_);
  }

 private:
  const Elimination::Part& part_;
  const std::vector<std::int32_t>& below_;
  Eigen::Index own_;
  std::size_t at_ = 0;
};

}  // namespace

class ShiftedLaplacian::Factorization {
 public:
  Factorization(const Laplacian& laplacian, std::span<const double> shift, const Elimination& elimination,
                std::vector<Block>& blocks)
      : laplacian_(laplacian),
        shift_(shift),
        elimination_(elimination),
        blocks_(blocks),
        place_(elimination.order.size()) {
    for (std::size_t row = 0; row < place_.size(); ++row)
      place_[elimination.order[row]] = static_cast<std::int32_t>(row);
  }

  bool run() {
    eliminate(static_cast<std::int32_t>(elimination_.parts.size()) - 1);
    return definite_;
  }

 private:
  using Matrix = Eigen::MatrixXd;

  // Returns the lower triangle of what is left on the rows below.
  Matrix eliminate(std::int32_t number) {
    const Elimination::Part& part = elimination_.parts[number];
    Matrix fromLower, fromUpper;
    inHalves(
        part, [&] { fromLower = eliminate(part.lower); }, [&] { fromUpper = eliminate(part.upper); });
    if (!definite_) return {};

    Block& block = blocks_[number];
    listRowsBelow(part, block.below);
    const Eigen::Index own = part.end - part.own, below = static_cast<Eigen::Index>(block.below.size());
    Matrix front = Matrix::Zero(own + below, own + below);
    addEntries(part, block.below, front);
    if (part.lower >= 0) {
      addRest(part, block.below, blocks_[part.lower].below, fromLower, front);
      addRest(part, block.below, blocks_[part.upper].below, fromUpper, front);
    }
    if (own == 0) return front;
    Eigen::Ref<Matrix> corner = front.topLeftCorner(own, own);
    if (Eigen::LLT<Eigen::Ref<Matrix>>(corner).info() != Eigen::Success) {
      definite_ = false;
      return {};
    }
    corner.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(
        front.bottomLeftCorner(below, own));
    block.values = front.leftCols(own);
    Matrix rest = front.bottomRightCorner(below, below);
    rest.selfadjointView<Eigen::Lower>().rankUpdate(block.values.bottomRows(below), -1);
    return rest;
  }

  void listRowsBelow(const Elimination::Part& part, std::vector<std::int32_t>& below) const {
    for (const std::int32_t half : {part.lower, part.upper}) {
      if (half < 0) continue;
      const std::vector<std::int32_t>& rows = blocks_[half].below;
      below.insert(below.end(), std::lower_bound(rows.begin(), rows.end(), part.end), rows.end());
    }
    for (std::int32_t row = part.own; row < part.end; ++row) {
      const std::int32_t vertex = elimination_.order[row];
      for (std::size_t e = laplacian_.rowStart[vertex]; e < laplacian_.rowStart[vertex + 1]; ++e) {
        if (const std::int32_t other = place_[laplacian_.column[e]]; other >= part.end)
          below.push_back(other);
      }
    }
    std::sort(below.begin(), below.end());
    below.erase(std::unique(below.begin(), below.end()), below.end());
  }

  void addEntries(const Elimination::Part& part, const std::vector<std::int32_t>& below,
                  Matrix& front) const {
    const Eigen::Index own = part.end - part.own;
    for (std::int32_t row = part.own; row < part.end; ++row) {
      const std::int32_t vertex = elimination_.order[row];
      const Eigen::Index column = row - part.own;
      double diagonal = shift_[vertex];
      for (std::size_t e = laplacian_.rowStart[vertex]; e < laplacian_.rowStart[vertex + 1]; ++e) {
        diagonal += laplacian_.weight[e];
        const std::int32_t other = place_[laplacian_.column[e]];
        if (other <= row) continue;  // the lower triangle alone
        const Eigen::Index at =
            other < part.end ? other - part.own
                             : own + (std::lower_bound(below.begin(), below.end(), other) - below.begin());
        front(at, column) -= laplacian_.weight[e];
      }
      front(column, column) += diagonal;
    }
  }

  static void addRest(const Elimination::Part& part, const std::vector<std::int32_t>& below,
                      const std::vector<std::int32_t>& rows, const Matrix& rest, Matrix& front) {
    std::vector<Eigen::Index> at;
    at.reserve(rows.size());
    RowFinder finder(part, below);
    for (const std::int32_t row : rows) at.push_back(finder.next(row));
    for (std::size_t c = 0; c < at.size(); ++c) {
      for (std::size_t r = c; r < at.size(); ++r)
        front(at[r], at[c]) += rest(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
    }
  }

  const Laplacian& laplacian_;
  std::span<const double> shift_;
  const Elimination& elimination_;
  std::vector<Block>& blocks_;
  std::vector<std::int32_t> place_;  ///< of a vertex in the order
  std::atomic<bool> definite_ = true;
};

ShiftedLaplacian::ShiftedLaplacian(const Laplacian& laplacian, std::span<const double> shift,
                                   std::span<const Vec3> positions)
    : elimination_(nestedDissection(laplacian, positions)), blocks_(elimination_.parts.size()) {
  if (!Factorization(laplacian, shift, elimination_, blocks_).run()) {
    throw Error(Errc::notConverged,
                "a Laplacian is not positive definite to rounding (triangles of nearly no area)");
  }
}

ShiftedLaplacian::Columns ShiftedLaplacian::forward(std::int32_t number, Columns& x) const {
  const Elimination::Part& part = elimination_.parts[number];
  const Block& block = blocks_[number];
  Columns fromLower, fromUpper;
  inHalves(
      part, [&] { fromLower = forward(part.lower, x); }, [&] { fromUpper = forward(part.upper, x); });
  const Eigen::Index own = part.end - part.own, below = static_cast<Eigen::Index>(block.below.size());
  Columns rows = Columns::Zero(own + below, 3);
  rows.topRows(own) = x.middleRows(part.own, own);
  const auto add = [&](std::int32_t half, const Columns& update) {
    RowFinder finder(part, block.below);
    for (Eigen::Index i = 0; i < update.rows(); ++i)
      rows.row(finder.next(blocks_[half].below[i])) += update.row(i);
  };
  if (part.lower >= 0) {
    add(part.lower, fromLower);
    add(part.upper, fromUpper);
  }
  if (own == 0) return rows;
  auto top = rows.topRows(own);
  block.values.topRows(own).triangularView<Eigen::Lower>().solveInPlace(top);
  rows.bottomRows(below).noalias() -= block.values.bottomRows(below) * top;
  x.middleRows(part.own, own) = top;
  return rows.bottomRows(below);
}

void ShiftedLaplacian::backward(std::int32_t number, Columns& x) const {
  const Elimination::Part& part = elimination_.parts[number];
  const Block& block = blocks_[number];
  const Eigen::Index own = part.end - part.own, below = static_cast<Eigen::Index>(block.below.size());
  if (own > 0) {
    Columns known(below, 3);
    for (Eigen::Index i = 0; i < below; ++i) known.row(i) = x.row(block.below[i]);
    auto top = x.middleRows(part.own, own);
    top.noalias() -= block.values.bottomRows(below).transpose() * known;
    block.values.topRows(own).triangularView<Eigen::Lower>().transpose().solveInPlace(top);
  }
  inHalves(
      part, [&] { backward(part.lower, x); }, [&] { backward(part.upper, x); });
}

void ShiftedLaplacian::solve(std::span<const Vec3> right, std::span<Vec3> out) const {
  const std::size_t n = elimination_.order.size();
  Columns x(static_cast<Eigen::Index>(n), 3);
  for (std::size_t i = 0; i < n; ++i)
    x.row(static_cast<Eigen::Index>(i)) = right[elimination_.order[i]].transpose();
  const auto whole = static_cast<std::int32_t>(elimination_.parts.size()) - 1;
  forward(whole, x);
  backward(whole, x);
  for (std::size_t i = 0; i < n; ++i)
    out[elimination_.order[i]] = x.row(static_cast<Eigen::Index>(i)).transpose();
}

}  // namespace polestar::detail
