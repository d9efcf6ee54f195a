// The oracles themselves: zero on the boundary, harmonic inside, and constants known from elsewhere.

#include "support/exact_green.h"

#include <gtest/gtest.h>

#include <numbers>

namespace polestar::testing {
namespace {

template <class H>
double laplacian(const H& h, const Vec3& x) {
  constexpr double kStep = 1e-3;
  double sum = -6 * h(x);
  for (int k = 0; k < 3; ++k) sum += h(x + kStep * Vec3::Unit(k)) + h(x - kStep * Vec3::Unit(k));
  return sum / (kStep * kStep);
}

TEST(ExactGreen, BallVanishesOnTheSphereAndIsHarmonic) {
  const BallGreen ball{Vec3(0.3, 0.2, -0.1)};
  for (const Vec3& w : {Vec3(1, 0, 0), Vec3(0, -1, 1), Vec3(2, 3, -1)})
    EXPECT_NEAR(ball.green(w.normalized()), 0, 1e-14);
  EXPECT_NEAR(laplacian([&](const Vec3& x) { return ball.h(x); }, Vec3(0.1, -0.4, 0.2)), 0, 1e-5);
  EXPECT_NEAR(-1 / ball.h(ball.pole), ball.harmonicRadius(), 1e-14);
}

TEST(ExactGreen, HalfBallVanishesOnDomeAndFloor) {
  const HalfBallGreen half{Vec3(0.1, 0, 0.4)};
  EXPECT_NEAR(half.green(Vec3(0.6, 0, 0.8)), 0, 1e-14);
  EXPECT_NEAR(half.green(Vec3(0.3, -0.5, 0)), 0, 1e-14);
  EXPECT_GT(half.green(Vec3(0.2, 0.2, 0.3)), 0);
}

TEST(ExactGreen, CubeHasTheMadelungConstantAtItsCenter) {
  // The images of a charge in the middle are a rock salt crystal of spacing 2: h = -M / 2, M
  // = 1.7475645946...
  const CubeGreen cube{Vec3::Zero()};
  EXPECT_NEAR(2 * cube.h(Vec3::Zero()), -1.74756459, 3e-6);
  const CubeGreen offCenter{Vec3(0.2, 0.1, -0.15)};
  EXPECT_NEAR(offCenter.green(Vec3(1, 0.3, -0.2)), 0, 1e-6);
  EXPECT_NEAR(offCenter.green(Vec3(0.5, -1, 0.7)), 0, 1e-6);
}

}  // namespace
}  // namespace polestar::testing
