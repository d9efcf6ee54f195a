#pragma once
// The slope of a vector-valued function on a surface, at a vertex from its ring.

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "polestar/core/types.h"

namespace polestar::detail {

/// Collects differences to the neighbours, then fits. Rings of more than kMostNeighbours are cut short.
class TangentFit {
 public:
  static constexpr std::size_t kMostNeighbours = 24;

  /// `normal`: unit, at right angles to the plane in which slopes are wanted.
  explicit TangentFit(const Vec3& normal) : e1_(normal.unitOrthogonal()), e2_(normal.cross(e1_)) {}

  void add(const Vec3& offset, const Vec3& change) {
    if (count_ == kMostNeighbours) return;
    const auto row = static_cast<Eigen::Index>(count_++);
    offset_.row(row) << e1_.dot(offset), e2_.dot(offset);
    change_.row(row) = change.transpose();
  }

  struct Slope {
    Mat3 slope;    ///< d function / d offset, zero along the normal
    double trust;  ///< 1, falling to 0 where the fit misses changes by 5 to 15 % of the largest: a kink
  };
  /// Quadratic where the ring has six neighbours or more, else linear; nothing where it determines no slope.
  /// What decides fades, so that rounding cannot switch it.
  std::optional<Slope> slope() const {
    const auto rows = static_cast<Eigen::Index>(count_);
    if (rows < 3) return std::nullopt;
    const double scale = offset_.topRows(rows).rowwise().norm().maxCoeff();
    if (!(scale > 0)) return std::nullopt;
    const Eigen::Index columns = rows > 5 ? 5 : 2;
    Matrix place(rows, columns);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double a = offset_(i, 0) / scale, b = offset_(i, 1) / scale;
      place(i, 0) = a;
      place(i, 1) = b;
      if (columns == 5) {
        place(i, 2) = a * a;
        place(i, 3) = a * b;
        place(i, 4) = b * b;
      }
    }
    const Changes change = change_.topRows(rows);
    const Eigen::ColPivHouseholderQR<Matrix> solver(place);
    if (solver.rank() < columns) return std::nullopt;
    const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, 5, 3> fitted = solver.solve(change);
    if (!fitted.allFinite()) return std::nullopt;
    const double misfit = (place * fitted - change).rowwise().norm().maxCoeff();
    const double largest = change.rowwise().norm().maxCoeff();
    const double trust = largest > 0 ? std::clamp(1.5 - 10 * misfit / largest, 0.0, 1.0) : 1;
    return Slope{
        (fitted.row(0).transpose() * e1_.transpose() + fitted.row(1).transpose() * e2_.transpose()) / scale,
        trust};
  }

 private:
  static constexpr int kMost = static_cast<int>(kMostNeighbours);
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMost, 5>;
  using Changes = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, kMost, 3>;

  Vec3 e1_, e2_;
  std::size_t count_ = 0;
  Eigen::Matrix<double, kMost, 2> offset_;
  Eigen::Matrix<double, kMost, 3> change_;
};

}  // namespace polestar::detail
