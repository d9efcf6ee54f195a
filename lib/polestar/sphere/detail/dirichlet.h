#pragma once
// Dirichlet energy of maps to the sphere: its minimum over maps of degree one is the conformal map.

#include <memory>

#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/shifted_laplacian.h"
#include "polestar/sphere/detail/sphere_descent.h"

namespace polestar::detail {

/// 1/4 sum_ij w_ij |s_i - s_j|^2 + kCenterPenalty |sum_i m_i s_i|^2, m the vertices' shares of the area.
///
/// The first term is 4 pi for a conformal map, up to the triangles' size, and would fall to 0 for a map that
/// shrinks to a point; the penalty excludes that and the Moebius maps on the way there. [Gu et al. 2004,
/// mass-center condition]
class DirichletEnergy final : public SphereEnergy {
 public:
  /// Factorizes the preconditioner; `positions` of the vertices guide its elimination order.
  DirichletEnergy(Laplacian laplacian, std::vector<double> massShares, std::span<const Vec3> positions);

  double evaluate(std::span<const Vec3> points, std::span<Vec3> gradient) const override;
  void precondition(std::span<const Vec3> gradient, std::span<Vec3> out) const override;

  /// More than the 4 pi that shrinking to a point would gain.
  static constexpr double kCenterPenalty = 20;

 private:
  Laplacian laplacian_;
  std::vector<double> massShares_;
  std::unique_ptr<const ShiftedLaplacian> preconditioner_;
};

}  // namespace polestar::detail
