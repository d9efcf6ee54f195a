#include "polestar/green/detail/point_charges.h"

#include <gtest/gtest.h>

#include <random>

namespace polestar::detail {
namespace {

TEST(PointCharges, SumsAgreeWithLongDoubles) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  PointCharges charges;
  for (int i = 0; i < 3001; ++i) {  // no multiple of any SIMD width or tile
    const Vec3 p = Vec3(normal(random), normal(random), normal(random)).normalized();
    charges.x.push_back(p[0]);
    charges.y.push_back(p[1]);
    charges.z.push_back(p[2]);
    charges.charge.push_back(normal(random));
  }
  charges.squaredSoftening = 1e-12;
  const std::vector<Vec3> points{{0, 0, 0}, {0.3, -0.2, 0.5}, {0.9, 0.1, 0.05}, {5, 4, 3}};
  std::vector<double> potential(points.size()), alone(points.size());
  std::vector<Vec3> gradient(points.size());
  sumPotentialAndGradient(charges, points, potential, gradient);
  sumPotential(charges, points, alone);
  for (std::size_t i = 0; i < points.size(); ++i) {
    long double sum = 0, slope[3] = {0, 0, 0}, scale = 0, slopeScale = 0;
    for (std::size_t j = 0; j < charges.size(); ++j) {
      const long double d[3] = {points[i][0] - charges.x[j], points[i][1] - charges.y[j],
                                points[i][2] - charges.z[j]};
      const long double r = sqrtl(1e-12L + d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      sum += charges.charge[j] / r;
      scale += std::abs(charges.charge[j]) / r;
      slopeScale += std::abs(charges.charge[j]) / (r * r);
      for (int k = 0; k < 3; ++k) slope[k] -= charges.charge[j] * d[k] / (r * r * r);
    }
    EXPECT_NEAR(potential[i], static_cast<double>(sum), 1e-14 * static_cast<double>(scale));
    EXPECT_NEAR(alone[i], static_cast<double>(sum), 1e-14 * static_cast<double>(scale));
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(gradient[i][k], static_cast<double>(slope[k]), 1e-14 * static_cast<double>(slopeScale));
    }
  }
}

TEST(PointCharges, NoChargesGiveZero) {
  const Vec3 p(1, 2, 3);
  double potential = 7;
  Vec3 gradient(7, 7, 7);
  sumPotentialAndGradient({}, {&p, 1}, {&potential, 1}, {&gradient, 1});
  EXPECT_EQ(potential, 0);
  EXPECT_EQ(gradient, Vec3::Zero());
}

}  // namespace
}  // namespace polestar::detail
