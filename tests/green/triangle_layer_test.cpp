#include "polestar/green/detail/triangle_layer.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace polestar::detail {
namespace {

// The integral by brute force: the triangle cut into 4^levels copies, each by the 3-point rule of degree two.
PotentialAndGradient byQuadrature(const std::array<Vec3, 3>& corner, const std::array<double, 3>& sigma,
                                  const Vec3& x, int levels) {
  if (levels == 0) {
    const double area = 0.5 * (corner[1] - corner[0]).cross(corner[2] - corner[0]).norm();
    PotentialAndGradient sum{0, Vec3::Zero()};
    for (int k = 0; k < 3; ++k) {
      const Vec3 offset = x - (corner[0] + corner[1] + corner[2] + 3 * corner[k]) / 6;
      const double charge = area / 3 * (sigma[0] + sigma[1] + sigma[2] + 3 * sigma[k]) / 6, r = offset.norm();
      sum.potential += charge / r;
      sum.gradient -= charge / (r * r * r) * offset;
    }
    return sum;
  }
  std::array<Vec3, 3> middle;
  std::array<double, 3> middleSigma;
  for (int k = 0; k < 3; ++k) {
    middle[k] = 0.5 * (corner[k] + corner[(k + 1) % 3]);
    middleSigma[k] = 0.5 * (sigma[k] + sigma[(k + 1) % 3]);
  }
  PotentialAndGradient sum{0, Vec3::Zero()};
  auto add = [&](const std::array<Vec3, 3>& c, const std::array<double, 3>& s) {
    const PotentialAndGradient part = byQuadrature(c, s, x, levels - 1);
    sum.potential += part.potential;
    sum.gradient += part.gradient;
  };
  for (int k = 0; k < 3; ++k) {
    add({corner[k], middle[k], middle[(k + 2) % 3]}, {sigma[k], middleSigma[k], middleSigma[(k + 2) % 3]});
  }
  add(middle, middleSigma);
  return sum;
}

class TriangleLayer : public ::testing::Test {
 protected:
  const std::array<Vec3, 3> corner_{Vec3(0.1, -0.2, 0.3), Vec3(1.2, 0.1, 0.2), Vec3(0.3, 0.9, -0.1)};
  const std::array<double, 3> sigma_{-0.7, 0.4, 1.3};
  const LayerTriangle triangle_{corner_[0], corner_[1], corner_[2]};
};

TEST_F(TriangleLayer, AgreesWithQuadratureAtAllDistances) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 60; ++i) {
    const double distance = std::pow(10.0, -1 + 0.05 * i);
    const Vec3 inPlane = corner_[0] + 0.6 * normal(random) * (corner_[1] - corner_[0]) +
                         0.6 * normal(random) * (corner_[2] - corner_[0]);
    const Vec3 x = inPlane + (i % 2 ? distance : -distance) * triangle_.normal;
    const PotentialAndGradient exact = linearLayer(triangle_, sigma_, x);
    const PotentialAndGradient reference = byQuadrature(corner_, sigma_, x, 7);
    EXPECT_NEAR(exact.potential, reference.potential, 2e-6) << "at distance " << distance;
    EXPECT_LT((exact.gradient - reference.gradient).norm(), 1e-4) << "at distance " << distance;
  }
}

TEST_F(TriangleLayer, HatsSumToTheLayer) {
  for (const Vec3& x : {Vec3(0.5, 0.3, 1.0), Vec3(0.5, 0.3, 0.12), Vec3(2, 2, 2)}) {
    const std::array<double, 3> hat = hatPotentials(triangle_, x);
    EXPECT_NEAR(hat[0] * sigma_[0] + hat[1] * sigma_[1] + hat[2] * sigma_[2],
                linearLayer(triangle_, sigma_, x).potential, 1e-13);
  }
}

TEST_F(TriangleLayer, FarAwayItIsItsCharge) {
  const Vec3 x(300, -200, 100);
  const double area = 0.5 * triangle_.twiceArea, charge = area * (sigma_[0] + sigma_[1] + sigma_[2]) / 3;
  // The dipole moment is at most charge scale times diameter.
  EXPECT_NEAR(linearLayer(triangle_, sigma_, x).potential, charge / x.norm(), 1.0 / x.squaredNorm());
}

TEST_F(TriangleLayer, GradientIsTheDerivative) {
  constexpr double kStep = 1e-5;
  for (const Vec3& x :
       {Vec3(0.5, 0.3, 0.4), Vec3(1.1, 0.2, 0.21), Vec3(0.12, -0.19, 0.29), Vec3(0.6, 0.6, -0.5)}) {
    const Vec3 gradient = linearLayer(triangle_, sigma_, x).gradient;
    for (int k = 0; k < 3; ++k) {
      const Vec3 offset = kStep * Vec3::Unit(k);
      const double difference = (linearLayer(triangle_, sigma_, x + offset).potential -
                                 linearLayer(triangle_, sigma_, x - offset).potential) /
                                (2 * kStep);
      EXPECT_NEAR(gradient[k], difference, 1e-5 * (1 + gradient.norm()));
    }
  }
}

TEST_F(TriangleLayer, NormalDerivativeJumpsByFourPiSigma) {
  const Vec3 q = 0.3 * corner_[0] + 0.3 * corner_[1] + 0.4 * corner_[2];
  const double sigma = 0.3 * sigma_[0] + 0.3 * sigma_[1] + 0.4 * sigma_[2];
  const Vec3 inside = linearLayer(triangle_, sigma_, q - 1e-9 * triangle_.normal).gradient;
  const Vec3 outside = linearLayer(triangle_, sigma_, q + 1e-9 * triangle_.normal).gradient;
  EXPECT_NEAR((inside - outside).dot(triangle_.normal), 4 * std::numbers::pi * sigma, 1e-6);
  EXPECT_LT((inside - outside).cross(triangle_.normal).norm(), 1e-6);
  // On the triangle the limit from inside is meant.
  EXPECT_LT((linearLayer(triangle_, sigma_, q).gradient - inside).norm(), 1e-6);
}

TEST_F(TriangleLayer, FiniteAndContinuousAtEdgesAndCorners) {
  for (const Vec3& x : {corner_[0], corner_[2], Vec3(0.5 * (corner_[0] + corner_[1]))}) {
    const PotentialAndGradient at = linearLayer(triangle_, sigma_, x);
    EXPECT_TRUE(std::isfinite(at.potential) && at.gradient.allFinite());
    EXPECT_NEAR(at.potential, linearLayer(triangle_, sigma_, x + Vec3(1e-9, 2e-9, -1e-9)).potential, 1e-6);
  }
}

TEST_F(TriangleLayer, NeedlesKeepTheirDigits) {
  // 1 : 1e5. The potential of a needle is that of a rod with linear density.
  const LayerTriangle needle({0, 0, 0}, {1, 0, 0}, {0, 1e-5, 0});
  const Vec3 x(0.4, 0.7, 0.3);
  const double d2 = x[1] * x[1] + x[2] * x[2];
  const double a = std::sqrt(x[0] * x[0] + d2), b = std::sqrt((1 - x[0]) * (1 - x[0]) + d2);
  const double log = std::asinh((1 - x[0]) / std::sqrt(d2)) + std::asinh(x[0] / std::sqrt(d2));
  const double rod = 1e-5 * ((1 - x[0]) * log - (b - a));  // integral of 1e-5 (1 - s)/|x - s|
  EXPECT_NEAR(linearLayer(needle, {1, 1, 1}, x).potential / rod, 1, 2e-5);
}

}  // namespace
}  // namespace polestar::detail
