#include "polestar/green/detail/truncation_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "polestar/green/detail/multipole.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

PointCharges chargesAt(const std::vector<Vec3>& points, bool bothSigns) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> strength(bothSigns ? -1 : 0.2, 1);
  PointCharges charges;
  for (const Vec3& p : points) {
    charges.x.push_back(p[0]);
    charges.y.push_back(p[1]);
    charges.z.push_back(p[2]);
    charges.charge.push_back(strength(random) / static_cast<double>(points.size()));
  }
  charges.squaredSoftening = 1e-24;
  return charges;
}

// An ellipsoid with a dense spot: large leaves of charges beside small boxes of targets.
std::vector<Vec3> gradedSurface(int levels) {
  std::vector<Vec3> points = icosphere(levels).vertices;
  for (Vec3& p : points) p = p.cwiseProduct(Vec3(1, 0.6, 0.3));
  for (const Vec3& p : icosphere(levels).vertices) points.push_back(Vec3(1, 0, 0) + 1e-2 * p);
  return points;
}

// Charges in the corners of the boxes, where expansions converge worst.
std::vector<Vec3> cornersOfBoxes() {
  std::vector<Vec3> points;
  for (int x = 0; x < 12; ++x) {
    for (int y = 0; y < 12; ++y) {
      for (int z = 0; z < 12; ++z) points.push_back(Vec3(x, y, z) / 12.0);
    }
  }
  return points;
}

TEST(TruncationBound, HoldsForSumsAtEveryOrderAndIsNotIdle) {
  const std::vector<std::vector<Vec3>> clouds{gradedSurface(4), icosphere(5).vertices, cornersOfBoxes()};
  for (std::size_t cloud = 0; cloud < clouds.size(); ++cloud) {
    for (const bool bothSigns : {false, true}) {
      const PointCharges charges = chargesAt(clouds[cloud], bothSigns);
      std::vector<Vec3> targets;
      for (const Vec3& p : icosphere(4).vertices) targets.push_back(0.98 * p.cwiseProduct(Vec3(1, 0.6, 0.3)));
      for (const Vec3& p : clouds[cloud]) targets.push_back(0.995 * p + Vec3(1e-3, 2e-3, 0));
      std::vector<double> exact(targets.size()), fast(targets.size());
      sumPotential(charges, targets, exact);
      for (const int order : {6, 10, 16, 22}) {
        const MultipoleSums sums(charges, targets, order);
        sums.potential(charges.charge, fast, Context::quiet());
        const std::vector<double> bound = sums.truncation(charges.charge);
        double worstError = 0, worstBound = 0;
        for (std::size_t i = 0; i < targets.size(); ++i) {
          const double error = std::abs(fast[i] - exact[i]);
          ASSERT_LE(error, bound[i] + 1e-14 * std::abs(exact[i]) + 1e-15)
              << cloud << ' ' << order << ' ' << i;
          worstError = std::max(worstError, error);
          worstBound = std::max(worstBound, bound[i]);
        }
        // Worst cases add up in the bound: every charge in the corner of its box, every target in the nearest
        // of its own. That costs some orders, and must not cost more.
        EXPECT_LT(worstBound, 1e5 * worstError) << cloud << ' ' << order;
      }
    }
  }
}

TEST(TruncationBound, HoldsAnywhereInAField) {
  const PointCharges charges = chargesAt(gradedSurface(4), false);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1, 1);
  std::vector<Vec3> points;
  for (int i = 0; i < 3000; ++i)
    points.push_back(Vec3(place(random), 0.6 * place(random), 0.3 * place(random)));
  for (const Vec3& p : gradedSurface(3)) points.push_back(0.999 * p);
  std::vector<double> exact(points.size()), fast(points.size());
  std::vector<Vec3> gradient(points.size());
  sumPotential(charges, points, exact);
  for (const int order : {6, 12, 18}) {
    const MultipoleField field(charges, order, 1e-4, Context::quiet());
    field.evaluate(points, fast, gradient, Context::quiet());
    double worst = 0;
    for (std::size_t i = 0; i < points.size(); ++i) worst = std::max(worst, std::abs(fast[i] - exact[i]));
    EXPECT_LE(worst, field.truncation() + 1e-13);
    EXPECT_LT(field.truncation(), 1e5 * worst);
  }
}

}  // namespace
}  // namespace polestar::detail
