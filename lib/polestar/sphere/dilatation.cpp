#include "polestar/sphere/dilatation.h"

#include <cmath>
#include <limits>

namespace polestar {

double dilatation(const std::array<Vec3, 3>& from, const std::array<Vec3, 3>& to) {
  // Both triangles in coordinates of their own planes: first edge along x.
  auto flat = [](const std::array<Vec3, 3>& t) {
    const Vec3 e = t[1] - t[0], f = t[2] - t[0];
    const double length = e.norm();
    return std::array<double, 3>{length, e.dot(f) / length, e.cross(f).norm() / length};
  };
  const auto [x1, x2, y2] = flat(from);
  const auto [u1, u2, v2] = flat(to);
  if (!(x1 > 0 && y2 > 0 && u1 > 0 && v2 > 0)) return std::numeric_limits<double>::infinity();
  // The Jacobian is upper triangular: (a b; 0 d).
  const double a = u1 / x1, d = v2 / y2, b = (u2 - a * x2) / y2;
  // sigma_1 / sigma_2 by the sum and difference of the singular values, which cancels nothing.
  const double sum = std::hypot(a + d, b), difference = std::hypot(a - d, b);
  const double smaller = 2 * a * d / (sum + difference);
  return 0.5 * (sum + difference) / smaller;
}

}  // namespace polestar
