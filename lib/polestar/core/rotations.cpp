#include "polestar/core/rotations.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace polestar {

std::vector<Mat3> spreadRotations(int count) {
  constexpr double kPhi = std::numbers::sqrt2;
  constexpr double kPsi = 1.533751168755204288118041;  // the positive root of psi^4 = psi + 4
  std::vector<Mat3> rotations;
  for (int i = 0; i < count; ++i) {
    const double s = i + 0.5, share = s / count, r = std::sqrt(share), rest = std::sqrt(1 - share);
    const double alpha = 2 * std::numbers::pi * s / kPhi, beta = 2 * std::numbers::pi * s / kPsi;
    rotations.push_back(Eigen::Quaterniond(rest * std::cos(beta), r * std::sin(alpha), r * std::cos(alpha),
                                           rest * std::sin(beta))
                            .toRotationMatrix());
  }
  return rotations;
}

}  // namespace polestar
