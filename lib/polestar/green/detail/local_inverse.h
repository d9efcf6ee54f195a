#pragma once
// Preconditioner of the single layer's first-kind equation.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/types.h"

namespace polestar::detail {

/// Row i approximates row i of the inverse by that of the kernel among the nearest vertices alone: the
/// operator's high frequencies are local, and they are what spoils the conditioning of a first-kind equation.
/// Memory: 12 bytes a neighbour and vertex.
class LocalInverse {
 public:
  static constexpr int kMaxNeighbours = 64;

  /// @param area of the surface around each vertex.
  LocalInverse(const std::vector<Vec3>& vertices, const Eigen::VectorXd& area, int neighbours,
               const Context& context);
  /// From potentials to densities.
  Eigen::VectorXd apply(const Eigen::VectorXd& potential, const Eigen::VectorXd& area) const;

 private:
  void invert(const std::vector<Vec3>& vertices, const Eigen::VectorXd& area, std::size_t i,
              const std::vector<std::pair<double, std::int32_t>>& nearest);

  std::size_t neighbours_ = 0;
  std::vector<std::int32_t> index_;
  std::vector<double> weight_;
};

}  // namespace polestar::detail
