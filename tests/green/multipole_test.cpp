#include "polestar/green/detail/multipole.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

PointCharges chargesAt(const std::vector<Vec3>& points, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> strength(-0.5, 1.5);
  PointCharges charges;
  for (const Vec3& p : points) {
    charges.x.push_back(p[0]);
    charges.y.push_back(p[1]);
    charges.z.push_back(p[2]);
    charges.charge.push_back(strength(random));
  }
  charges.squaredSoftening = 1e-20;
  return charges;
}

std::vector<Vec3> pointsInBox(const Vec3& center, double side, std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-0.5, 0.5);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(center + side * Vec3(place(random), place(random), place(random)));
  return points;
}

PointView viewOf(const PointCharges& c) { return {c.x.data(), c.y.data(), c.z.data(), c.size()}; }

// Points on an ellipsoid with a dense spot, so that the trees are deep in one place only.
std::vector<Vec3> gradedSurface() {
  std::vector<Vec3> points = icosphere(4).vertices;
  for (Vec3& p : points) p = p.cwiseProduct(Vec3(1, 0.6, 0.3));
  for (const Vec3& p : icosphere(4).vertices) points.push_back(Vec3(1, 0, 0) + 1e-3 * p);
  return points;
}

// What the error of a sum is to be compared with: the potential of the charges' magnitudes.
std::vector<double> magnitudes(PointCharges charges, const std::vector<Vec3>& targets) {
  for (double& q : charges.charge) q = std::abs(q);
  std::vector<double> result(targets.size());
  sumPotential(charges, targets, result);
  return result;
}

TEST(SolidHarmonics, AreHarmonicAndGiveTheKernel) {
  // 1/|x - y| = sum R_i(y) R_i(x)/|x|^(2n+1).
  const Vec3 x(0.7, -1.1, 0.9), y(0.2, 0.1, -0.15);
  constexpr int kOrder = 20;
  std::vector<double> atX(expansionSize(kOrder)), atY(atX);
  solidHarmonics(kOrder, x, atX.data());
  solidHarmonics(kOrder, y, atY.data());
  double sum = 0;
  for (int n = 0; n <= kOrder; ++n) {
    for (int i = n * n; i < (n + 1) * (n + 1); ++i) sum += atX[i] * atY[i] / std::pow(x.norm(), 2 * n + 1);
  }
  EXPECT_NEAR(sum, 1 / (x - y).norm(), 1e-13);
  // Degree 1 is z, x, y.
  EXPECT_DOUBLE_EQ(atX[1], x[2]);
  EXPECT_DOUBLE_EQ(atX[2], x[0]);
  EXPECT_DOUBLE_EQ(atX[3], x[1]);
}

TEST(SolidHarmonics, TurnByOrthogonalMatrices) {
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(0.3, 0.5, -0.7).normalized()).toRotationMatrix();
  constexpr int kOrder = 24;
  const auto rotations = harmonicRotations(kOrder, turn);
  const Vec3 x = Vec3(0.3, -0.2, 0.4).normalized();
  std::vector<double> before(expansionSize(kOrder)), after(before);
  solidHarmonics(kOrder, x, before.data());
  solidHarmonics(kOrder, turn * x, after.data());
  for (int n = 0; n <= kOrder; ++n) {
    const int width = 2 * n + 1;
    const Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>> matrix(rotations[n].data(), width,
                                                                                  width);
    EXPECT_LT((matrix * matrix.transpose() - Eigen::MatrixXd::Identity(width, width)).norm(), 1e-12) << n;
    const Eigen::Map<const Eigen::VectorXd> a(&before[n * n], width), b(&after[n * n], width);
    EXPECT_LT((matrix * a - b).norm(), 1e-12) << n;
  }
}

TEST(SolidHarmonics, LocalGradientIsTheDerivativeOfThePotential) {
  constexpr int kOrder = 9;
  std::vector<double> local(expansionSize(kOrder));
  std::mt19937 random(5);
  for (double& c : local) c = std::uniform_real_distribution<double>(-1, 1)(random);
  const ExpansionFrame frame{Vec3(0.1, -0.2, 0.3), 0.7};
  for (const Vec3& x : pointsInBox(frame.center, frame.scale, 11, 3)) {
    auto value = [&](const Vec3& p) {
      double result = 0;
      addLocalPotential(kOrder, frame, local.data(), {&p[0], &p[1], &p[2], 1}, &result);
      return result;
    };
    double potential = 0;
    Vec3 gradient = Vec3::Zero();
    addLocalPotentialAndGradient(kOrder, frame, local.data(), {&x, 1}, &potential, &gradient);
    EXPECT_NEAR(potential, value(x), 1e-13);
    constexpr double kStep = 1e-5;
    for (int k = 0; k < 3; ++k) {
      const Vec3 step = kStep * Vec3::Unit(k);
      EXPECT_NEAR(gradient[k], (value(x + step) - value(x - step)) / (2 * kStep), 1e-8);
    }
  }
}

TEST(Translations, BetweenParentAndChildAreExact) {
  constexpr int kOrder = 10;
  const Translations translations(kOrder);
  const std::size_t size = expansionSize(kOrder);
  for (int octant = 0; octant < 8; ++octant) {
    const Vec3 child(octant & 1 ? 0.25 : -0.25, octant & 2 ? 0.25 : -0.25, octant & 4 ? 0.25 : -0.25);
    const ExpansionFrame inParent{Vec3::Zero(), 1}, inChild{child, 0.5};
    const PointCharges charges = chargesAt(pointsInBox(child, 0.5, 13, octant + 1), 2);
    std::vector<double> small(size), moved(size), direct(size);
    addMultipole(kOrder, inChild, viewOf(charges), charges.charge.data(), small.data());
    addMultipole(kOrder, inParent, viewOf(charges), charges.charge.data(), direct.data());
    const Translations::Pair pair{0, 0};
    translations.multipoleToParent(octant, {&pair, 1}, small.data(), moved.data());
    for (std::size_t i = 0; i < size; ++i) EXPECT_NEAR(moved[i], direct[i], 1e-13);

    std::vector<double> local(size), below(size);
    const PointCharges far = chargesAt(pointsInBox(Vec3(2.5, 1, -0.3), 1, 9, 4), 7);
    addLocal(kOrder, inParent, viewOf(far), far.charge.data(), local.data());
    translations.localToChild(octant, {&pair, 1}, local.data(), below.data());
    for (const Vec3& x : pointsInBox(child, 0.5, 7, 9)) {
      double above = 0, under = 0;
      addLocalPotential(kOrder, inParent, local.data(), {&x[0], &x[1], &x[2], 1}, &above);
      addLocalPotential(kOrder, inChild, below.data(), {&x[0], &x[1], &x[2], 1}, &under);
      EXPECT_NEAR(above, under, 1e-13);
    }
  }
}

TEST(Translations, ToLocalConvergeForEveryOffset) {
  const PointCharges charges = chargesAt(pointsInBox(Vec3::Zero(), 1, 20, 1), 2);
  for (const int order : {6, 12, 24}) {
    const Translations translations(order);
    std::vector<double> multipole(expansionSize(order));
    addMultipole(order, {Vec3::Zero(), 1}, viewOf(charges), charges.charge.data(), multipole.data());
    double worst = 0;
    for (int x = -3; x <= 3; ++x) {
      for (int y = -3; y <= 3; ++y) {
        for (int z = -3; z <= 3; ++z) {
          if (std::max({std::abs(x), std::abs(y), std::abs(z)}) < 2) continue;
          const Vec3 center(x, y, z);
          std::vector<double> local(multipole.size());
          const Translations::Pair pair{0, 0};
          translations.multipoleToLocal({x, y, z}, {&pair, 1}, multipole.data(), local.data());
          const std::vector<Vec3> points = pointsInBox(center, 1, 3, 8);
          std::vector<double> exact(points.size());
          sumPotential(charges, points, exact);
          for (std::size_t i = 0; i < points.size(); ++i) {
            double value = 0;
            const Vec3& p = points[i];
            addLocalPotential(order, {center, 1}, local.data(), {&p[0], &p[1], &p[2], 1}, &value);
            worst = std::max(worst, std::abs(value - exact[i]) / 20);
          }
        }
      }
    }
    // Geometric in the order; boxes that nearly touch converge worst, like (sqrt(3)/2 / 1.13)^order.
    EXPECT_LT(worst, 0.3 * std::pow(0.8660 / 1.134, order)) << order;
  }
}

TEST(MultipoleSums, AgreeWithDirectSumsOnGradedSurfaces) {
  const std::vector<Vec3> points = gradedSurface();
  const PointCharges charges = chargesAt(points, 3);
  std::vector<Vec3> targets;  // some on charges, some between, some in the middle of nowhere
  for (std::size_t i = 0; i < points.size(); ++i)
    targets.push_back(i % 3 == 0 ? points[i] : 0.999 * points[i] + Vec3(1e-5, 0, 0));
  targets.push_back(Vec3(3, 2, 1));
  std::vector<double> exact(targets.size()), fast(targets.size());
  DirectSums(charges, targets).potential(charges.charge, exact, Context::quiet());
  const std::vector<double> scale = magnitudes(charges, targets);
  // Six orders more gain two digits, here from 2e-3 on, since targets are compared with what is around them.
  for (const auto& [order, tolerance] : {std::pair{6, 2e-3}, std::pair{12, 2e-5}, std::pair{24, 2e-9}}) {
    MultipoleSums(charges, targets, order).potential(charges.charge, fast, Context::quiet());
    for (std::size_t i = 0; i < targets.size(); ++i)
      ASSERT_LT(std::abs(fast[i] - exact[i]), tolerance * scale[i]) << order << ' ' << i;
  }
}

TEST(MultipoleSums, KeepWhatTruncationErrorPromises) {
  // Charges of one sign on a surface without dense spots: the largest potential is a few units.
  std::vector<Vec3> points = icosphere(4).vertices, targets = icosphere(3).vertices;
  PointCharges charges = chargesAt(points, 3);
  for (double& q : charges.charge) q = std::abs(q) / static_cast<double>(points.size());
  for (Vec3& p : targets) p *= 0.98;  // as near as the charges are to each other
  std::vector<double> exact(targets.size()), fast(targets.size());
  sumPotential(charges, targets, exact);
  const double largest = *std::max_element(exact.begin(), exact.end());
  for (const double accuracy : {1e-4, 1e-6, 1e-8, 1e-10}) {
    const int order = orderFor(accuracy);
    EXPECT_LE(truncationError(order), accuracy);
    MultipoleSums(charges, targets, order).potential(charges.charge, fast, Context::quiet());
    double worst = 0;
    for (std::size_t i = 0; i < targets.size(); ++i) worst = std::max(worst, std::abs(fast[i] - exact[i]));
    EXPECT_LE(worst, accuracy * largest) << order;
    EXPECT_GT(worst, 0) << "the trees are too shallow for translations";
  }
}

TEST(MultipoleSums, AreLinearAndTheSameForAnyNumberOfThreads) {
  const std::vector<Vec3> points = gradedSurface();
  const PointCharges charges = chargesAt(points, 3);
  const MultipoleSums sums(charges, points, 8);
  std::vector<double> once(points.size()), twice(points.size());
  withThreads(1, [&] { sums.potential(charges.charge, once, Context::quiet()); });
  withThreads(2, [&] { sums.potential(charges.charge, twice, Context::quiet()); });
  EXPECT_EQ(once, twice);
  std::vector<double> doubled = charges.charge;
  for (double& q : doubled) q *= 2;
  sums.potential(doubled, twice, Context::quiet());
  for (std::size_t i = 0; i < once.size(); ++i) EXPECT_EQ(2 * once[i], twice[i]);  // a power of two is exact
}

TEST(MultipoleSums, InSinglePrecisionRoundAsTheySay) {
  auto rounding = [](const std::vector<Vec3>& points, const std::vector<Vec3>& targets) {
    const PointCharges charges = chargesAt(points, 3);
    const MultipoleSums full(charges, targets, 12);
    std::vector<double> exact(targets.size()), rounded(targets.size());
    full.potential(charges.charge, exact, Context::quiet());
    full.withOrder(12, PairPrecision::single).potential(charges.charge, rounded, Context::quiet());
    const std::vector<double> size = magnitudes(charges, targets);
    double worst = 0;
    for (std::size_t i = 0; i < targets.size(); ++i)
      worst = std::max(worst, std::abs(rounded[i] - exact[i]) / size[i]);
    EXPECT_GT(worst, 1e-10) << "nothing was rounded";
    return worst;
  };
  std::vector<Vec3> below = icosphere(5).vertices;
  for (Vec3& p : below) p *= 0.98;
  EXPECT_LT(rounding(icosphere(5).vertices, below), 1e-6);
  std::vector<Vec3> beside = gradedSurface();
  for (Vec3& p : beside) p += 1e-4 * Vec3(1, -1, 1);
  EXPECT_LT(rounding(gradedSurface(), beside), 1e-4);
}

TEST(MultipoleSums, StopWhenCancelled) {
  const std::vector<Vec3> points = gradedSurface();
  const PointCharges charges = chargesAt(points, 3);
  Context context;
  context.cancel();
  std::vector<double> potential(points.size());
  EXPECT_THROW(MultipoleSums(charges, points, 6).potential(charges.charge, potential, context), Error);
}

TEST(MultipoleField, GivesPotentialAndGradientAnywhereInTheCube) {
  const PointCharges charges = chargesAt(gradedSurface(), 3);
  const MultipoleField field(charges, 16, 1e-5, Context::quiet());
  std::vector<Vec3> points = pointsInBox(Vec3::Zero(), 1.2, 400, 6);
  for (const Vec3& p : gradedSurface()) points.push_back(0.9993 * p);  // close to the charges
  std::vector<double> potential(points.size()), exact(points.size());
  std::vector<Vec3> gradient(points.size()), exactGradient(points.size());
  field.evaluate(points, potential, gradient, Context::quiet());
  sumPotentialAndGradient(charges, points, exact, exactGradient);
  const std::vector<double> scale = magnitudes(charges, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LT(std::abs(potential[i] - exact[i]), 3e-6 * scale[i]) << i;
    // The nearest charge sets the scale of the gradient.
    ASSERT_LT((gradient[i] - exactGradient[i]).norm(), 3e-6 * scale[i] * scale[i]) << i;
  }
}

}  // namespace
}  // namespace polestar::detail
