// Signs of orient3d and orientDirections against rational arithmetic.

#include "polestar/core/predicates.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <random>

#include "support/exact.h"

namespace polestar {
namespace {

using testing::exact;
using Points = std::array<Vec3, 4>;

int signOf(const testing::Rational& x) { return x.sign(); }

int exactOrient(const Points& p) {
  const auto a = exact(p[0]);
  return signOf(testing::determinant(testing::difference(exact(p[1]), a), testing::difference(exact(p[2]), a),
                                     testing::difference(exact(p[3]), a)));
}

int exactOrientDirections(const Points& p) {
  return signOf(testing::determinant(exact(p[0]), exact(p[1]), exact(p[2])));
}

int roundedSign(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double d = a.dot(b.cross(c));
  return (d > 0) - (d < 0);
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low = -1, double high = 1) {
    return std::uniform_real_distribution<>(low, high)(engine_);
  }
  int integer(int low, int high) { return std::uniform_int_distribution<>(low, high)(engine_); }
  Vec3 point() { return {uniform(), uniform(), uniform()}; }
  Vec3 latticePoint(int size) {
    return Vec3(integer(-size, size), integer(-size, size), integer(-size, size));
  }

 private:
  std::mt19937_64 engine_;
};

struct Tally {
  int positive = 0, zero = 0, negative = 0;
  // Where a plain determinant in doubles has another sign.
  int roundedWrong = 0, roundedDirectionsWrong = 0;
};

// Every sign of `count` samples, orient3d and orientDirections, must be the exact one.
Tally expectExactSigns(int count, const std::function<Points()>& sample) {
  Tally tally;
  for (int i = 0; i < count; ++i) {
    const Points p = sample();
    const int expected = exactOrient(p);
    EXPECT_EQ(orient3d(p[0], p[1], p[2], p[3]), expected) << "sample " << i;
    const int expectedDirections = exactOrientDirections(p);
    EXPECT_EQ(orientDirections(p[0], p[1], p[2]), expectedDirections) << "sample " << i;
    ++(expected > 0 ? tally.positive : expected < 0 ? tally.negative : tally.zero);
    tally.roundedWrong += roundedSign(p[1] - p[0], p[2] - p[0], p[3] - p[0]) != expected;
    tally.roundedDirectionsWrong += roundedSign(p[0], p[1], p[2]) != expectedDirections;
    if (::testing::Test::HasFailure()) break;
  }
  return tally;
}

TEST(Predicates, SignConvention) {
  const Vec3 o(0, 0, 0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  EXPECT_EQ(orient3d(o, x, y, z), 1);
  EXPECT_EQ(orient3d(o, x, y, -z), -1);
  EXPECT_EQ(orient3d(o, x, y, x + y), 0);
  EXPECT_EQ(orientDirections(x, y, z), 1);
  EXPECT_EQ(orientDirections(y, x, z), -1);
  EXPECT_EQ(orientDirections(x, y, x - 3 * y), 0);
}

TEST(Predicates, RandomPoints) {
  Random random(1);
  const Tally tally = expectExactSigns(20000, [&] {
    return Points{random.point(), random.point(), random.point(), random.point()};
  });
  EXPECT_GT(tally.positive, 9000);
  EXPECT_GT(tally.negative, 9000);
}

TEST(Predicates, PointsRoundedOntoThePlaneAreHardAndStillExact) {
  Random random(2);
  const Tally tally = expectExactSigns(20000, [&] {
    const Vec3 a = random.point(), b = random.point(), c = random.point();
    const double s = random.uniform(), t = random.uniform();
    return Points{a, b, c, Vec3(a + s * (b - a) + t * (c - a))};
  });
  // The samples must be ones that rounded arithmetic gets wrong, or this test shows nothing.
  EXPECT_GT(tally.roundedWrong, 2000);
  EXPECT_GT(tally.positive, 2000);
  EXPECT_GT(tally.negative, 2000);
}

TEST(Predicates, DirectionsRoundedOntoAPlaneAreStillExact) {
  Random random(3);
  const Tally tally = expectExactSigns(20000, [&] {
    const Vec3 a = random.point(), b = random.point();
    return Points{a, b, Vec3(random.uniform() * a + random.uniform() * b), random.point()};
  });
  EXPECT_GT(tally.roundedDirectionsWrong, 2000);
}

TEST(Predicates, OneUlpOffAPlane) {
  Random random(4);
  const Tally tally = expectExactSigns(10000, [&] {
    const double height = random.uniform();
    Points p;
    for (Vec3& v : p) v = Vec3(random.uniform(), random.uniform(), height);
    const double other = random.integer(0, 1) ? 10.0 : -10.0;
    if (random.integer(0, 2)) p[3][2] = std::nextafter(height, other);
    return p;
  });
  EXPECT_GT(tally.zero, 2000);
  EXPECT_GT(tally.positive, 2000);
  EXPECT_GT(tally.negative, 2000);
}

TEST(Predicates, LatticePointsAreOftenCoplanar) {
  Random random(5);
  const Tally tally = expectExactSigns(20000, [&] {
    return Points{random.latticePoint(2), random.latticePoint(2), random.latticePoint(2),
                  random.latticePoint(2)};
  });
  EXPECT_GT(tally.zero, 2000);
}

TEST(Predicates, LargeLatticePointsAreExactlyCoplanar) {
  Random random(6);
  const Tally tally = expectExactSigns(5000, [&] {
    const Vec3 a = random.latticePoint(1 << 20), u = random.latticePoint(1 << 20),
               v = random.latticePoint(1 << 20);
    return Points{a, Vec3(a + u), Vec3(a + v),
                  Vec3(a + random.integer(-9, 9) * u + random.integer(-9, 9) * v)};
  });
  EXPECT_EQ(tally.zero, 5000);
}

TEST(Predicates, FarFromTheOrigin) {
  Random random(7);
  const Vec3 offset(1e6, -2e6, 5e5);
  const Tally tally = expectExactSigns(10000, [&] {
    const Vec3 a = random.point(), b = random.point(), c = random.point();
    const Vec3 d = a + random.uniform() * (b - a) + random.uniform() * (c - a);
    return Points{Vec3(a + offset), Vec3(b + offset), Vec3(c + offset), Vec3(d + offset)};
  });
  EXPECT_GT(tally.positive, 2000);
}

TEST(Predicates, FromTheSmallestToTheLargestNumbers) {
  Random random(8);
  auto wild = [&](double decades) {
    return random.uniform() * std::pow(10.0, random.uniform(-decades, decades));
  };
  for (const double decades : {49, 150, 307}) {
    expectExactSigns(5000, [&] {
      Points p;
      for (Vec3& v : p) v = Vec3(wild(decades), wild(decades), random.integer(0, 3) ? wild(decades) : 0.0);
      return p;
    });
  }
  for (const double scale : {1e-321, 1e-310, 1e-200, 1e-110, 1e-49, 1e49, 1e110, 1e200, 4e307}) {
    const Tally tally = expectExactSigns(2000, [&] {
      const Vec3 a = scale * random.point(), b = scale * random.point(), c = scale * random.point();
      return Points{a, b, c, Vec3(a + random.uniform() * (b - a) + random.uniform() * (c - a))};
    });
    EXPECT_GT(tally.positive, 100) << scale;
    EXPECT_GT(tally.negative, 100) << scale;
  }
}

TEST(Predicates, WhatUnderflowTakesIsNotDecidedByRounding) {
  // Minors of denormal numbers that a large entry multiplies: rounded they are 0 or the least number.
  Random random(11);
  const Tally tally = expectExactSigns(5000, [&] {
    Points p;
    p[0] = Vec3(1e300 * random.uniform(), 1e300 * random.uniform(), 1e300 * random.uniform());
    for (int i = 1; i < 3; ++i) p[i] = 2e-162 * random.point();
    p[3] = random.point();
    return p;
  });
  EXPECT_GT(tally.roundedDirectionsWrong, 100);
}

TEST(Predicates, WhatIsNoNumberHasNoOrientation) {
  Random random(12);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    for (int i = 0; i < 12; ++i) {
      Points p{random.point(), random.point(), random.point(), random.point()};
      p[i / 3][i % 3] = bad;
      EXPECT_EQ(orient3d(p[0], p[1], p[2], p[3]), 0);
      EXPECT_EQ(orientDirections(p[i / 3], p[(i + 3) / 3 % 4], p[(i + 6) / 3 % 4]), 0);
    }
  }
}

TEST(Predicates, PermutationsChangeTheSignAsTheyMust) {
  Random random(9);
  for (int i = 0; i < 500; ++i) {
    const Vec3 a = random.point(), b = random.point(), c = random.point();
    const Points p{a, b, c, Vec3(a + random.uniform() * (b - a) + random.uniform() * (c - a))};
    const int sign = orient3d(p[0], p[1], p[2], p[3]);
    std::array<int, 4> order{0, 1, 2, 3};
    do {
      int inversions = 0;
      for (int j = 0; j < 4; ++j) {
        for (int k = j + 1; k < 4; ++k) inversions += order[j] > order[k];
      }
      EXPECT_EQ(orient3d(p[order[0]], p[order[1]], p[order[2]], p[order[3]]), inversions % 2 ? -sign : sign);
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

TEST(Predicates, DirectionsAreATriangleSeenFromTheOrigin) {
  Random random(10);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 a = random.latticePoint(3), b = random.latticePoint(3), c = random.latticePoint(3);
    EXPECT_EQ(orientDirections(a, b, c), -orient3d(a, b, c, Vec3::Zero()));
  }
}

}  // namespace
}  // namespace polestar
