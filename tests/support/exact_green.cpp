#include "support/exact_green.h"

#include <cmath>
#include <numbers>

namespace polestar::testing {

double BallGreen::h(const Vec3& x) const {
  const double a2 = pole.squaredNorm();
  if (a2 == 0) return -1;
  return -1 / (std::sqrt(a2) * (x - pole / a2).norm());
}

double BallGreen::green(const Vec3& x) const { return 1 / (x - pole).norm() + h(x); }

double BallGreen::harmonicMeasure(const Vec3& x) const {
  return (1 - pole.squaredNorm()) / (4 * std::numbers::pi * std::pow((x - pole).norm(), 3));
}

double BallGreen::streamFunction(const Vec3& x) const {
  const double a = pole.norm();
  const Vec3 axis = pole / a, image = pole / (a * a);
  return axis.dot((x - pole).normalized()) - axis.dot((x - image).normalized()) / a;
}

double HalfBallGreen::green(const Vec3& x) const {
  const Vec3 mirrored(pole[0], pole[1], -pole[2]);
  return BallGreen{pole}.green(x) - BallGreen{mirrored}.green(x);
}

double HalfBallGreen::harmonicRadius() const {
  const Vec3 mirrored(pole[0], pole[1], -pole[2]);
  return -1 / (BallGreen{pole}.h(pole) - BallGreen{mirrored}.green(pole));
}

double CubeGreen::h(const Vec3& x) const {
  constexpr int kCells = 14;  // each way; the rest is below 1e-6, see the test of the oracle itself
  double sum = 0;
  for (int i = -kCells; i <= kCells; ++i) {
    for (int j = -kCells; j <= kCells; ++j) {
      for (int k = -kCells; k <= kCells; ++k) {
        for (int s = 0; s < 8; ++s) {
          // In coordinates from the lower corner, a charge at p has images at 4 n + p (same sign) and 4 n -
          // p.
          const bool mx = s & 1, my = s & 2, mz = s & 4;
          if (i == 0 && j == 0 && k == 0 && s == 0) continue;
          const Vec3 p = pole + Vec3::Ones();
          const Vec3 image(4 * i + (mx ? -p[0] : p[0]) - 1, 4 * j + (my ? -p[1] : p[1]) - 1,
                           4 * k + (mz ? -p[2] : p[2]) - 1);
          sum += ((mx != my) != mz ? -1 : 1) / (x - image).norm();
        }
      }
    }
  }
  return sum;
}

}  // namespace polestar::testing
