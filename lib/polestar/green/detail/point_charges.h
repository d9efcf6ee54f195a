#pragma once
// Sums over point charges: the far field of the layer, by direct summation.

#include <cstddef>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// Positions and strengths as separate arrays, for SIMD loops.
///
/// The kernel is 1/sqrt(|x - y|^2 + softening^2). The softening lies far below every length of the mesh; it
/// keeps a charge that sits under the evaluation point finite, so that subtracting it again (the near field
/// replaces it by the exact integral) is exact up to rounding.
struct PointCharges {
  std::vector<double> x, y, z, charge;
  double squaredSoftening = 0;

  std::size_t size() const { return x.size(); }
};

std::vector<Vec3> positionsOf(const PointCharges& charges);

/// The same in single precision, about a place in their middle.
struct SinglePointCharges {
  std::vector<float> x, y, z, charge;
  float squaredSoftening = 0;

  std::size_t size() const { return x.size(); }
};

/// potential[i] = sum over charges at points[i]. Serial; call it on small blocks from parallel loops.
void sumPotential(const PointCharges& charges, std::span<const Vec3> points, std::span<double> potential);

/// Points about the same place. Rounds to 1e-7 of the distances from it.
void sumPotential(const SinglePointCharges& charges, std::span<const Eigen::Vector3f> points,
                  std::span<double> potential);

/// The same with the gradient.
void sumPotentialAndGradient(const PointCharges& charges, std::span<const Vec3> points,
                             std::span<double> potential, std::span<Vec3> gradient);

}  // namespace polestar::detail
