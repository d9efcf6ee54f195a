#include "polestar/map/detail/sphere_spline.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

namespace polestar::detail {
namespace {

/// Added to the kernel, a hundred times as large as its values: what a constant field costs.
constexpr double kConstant = 1;

/// R(1 - 2 w), w the square of half the chord.
double kernel(double w) {
  constexpr double kScale = 1 / (2 * std::numbers::pi);
  if (!(w > 0)) return kConstant + kScale / 12;
  const double root = std::sqrt(w), logarithm = std::log1p(1 / root);
  const double q = 0.5 * (logarithm * (12 * w * w - 4 * w) - 12 * w * root + 6 * w + 1);
  return kConstant + kScale * (0.5 * q - 1.0 / 6);
}

Eigen::Matrix<double, 3, 2> tangents(const Vec3& normal) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = normal.unitOrthogonal();
  basis.col(1) = normal.cross(basis.col(0));
  return basis;
}

}  // namespace

SphereSpline::SphereSpline(std::span<const Demand> demands, double resolution) {
  const auto n = static_cast<Eigen::Index>(demands.size());
  std::vector<Eigen::Matrix<double, 3, 2>> basis;
  for (const Demand& demand : demands) {
    points_.push_back(demand.point);
    basis.push_back(tangents(demand.point));
  }
  // The difference of two kernels r apart is r^2 / (8 pi) times a logarithm.
  const double slack = resolution * resolution / (8 * std::numbers::pi);
  Eigen::MatrixXd matrix(2 * n, 2 * n);
  Eigen::VectorXd right(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double value = kernel(0.25 * (points_[i] - points_[j]).squaredNorm());
      matrix.block<2, 2>(2 * i, 2 * j) = value * basis[i].transpose() * basis[j];
    }
    matrix.diagonal().segment<2>(2 * i).array() += slack / demands[i].weight;
    right.segment<2>(2 * i) = basis[i].transpose() * demands[i].velocity;
  }
  const Eigen::VectorXd solution = matrix.selfadjointView<Eigen::Lower>().llt().solve(right);
  for (Eigen::Index i = 0; i < n; ++i) alpha_.push_back(basis[i] * solution.segment<2>(2 * i));
}

Vec3 SphereSpline::operator()(const Vec3& x) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t j = 0; j < points_.size(); ++j)
    sum += kernel(0.25 * (x - points_[j]).squaredNorm()) * alpha_[j];
  return sum;
}

}  // namespace polestar::detail
