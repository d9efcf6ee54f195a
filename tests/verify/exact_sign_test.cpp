// Signs against rational arithmetic, over all of a double's range, and against the library's predicates.
#include "verify/exact_sign.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "polestar/core/predicates.h"
#include "support/exact.h"

namespace polestar::testing {
namespace {

using Point = verify::Vec3;

Vec3 toEigen(const Point& p) { return {p.x, p.y, p.z}; }

int signOf(const Rational& r) { return r.sign(); }

int rationalOrientation(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Rational3 origin = exact(toEigen(a));
  return signOf(determinant(difference(exact(toEigen(b)), origin), difference(exact(toEigen(c)), origin),
                            difference(exact(toEigen(d)), origin)));
}

int rationalDeterminant(const Point& a, const Point& b, const Point& c) {
  return signOf(determinant(exact(toEigen(a)), exact(toEigen(b)), exact(toEigen(c))));
}

void expectRight(const Point& a, const Point& b, const Point& c, const Point& d) {
  EXPECT_EQ(verify::orientation(a, b, c, d), rationalOrientation(a, b, c, d));
  EXPECT_EQ(verify::signOfDeterminant(a, b, c), rationalDeterminant(a, b, c));
}

TEST(ExactSign, AnyFiniteDoublesTheSmallestAndLargestIncluded) {
  std::mt19937_64 random(1);
  const auto number = [&] {
    while (true) {
      const double x = std::bit_cast<double>(random());
      if (std::isfinite(x)) return x;
    }
  };
  const auto point = [&] { return Point{number(), number(), number()}; };
  for (int i = 0; i < 60; ++i) expectRight(point(), point(), point(), point());
}

TEST(ExactSign, SubnormalsAndHugeNumbersInFlatPositions) {
  std::mt19937 random(2);
  std::uniform_int_distribution<int> small(-3, 3);
  const double least = std::numeric_limits<double>::denorm_min();
  for (const double unit : {least, 5 * least, 1e-320, 1e-308, 1e-200, 1e-80, 1.0, 1e80, 1e150, 1e307}) {
    int zeros = 0;
    for (int i = 0; i < 100; ++i) {
      const auto point = [&] {
        return Point{unit * small(random), unit * small(random), unit * small(random)};
      };
      const Point a = point(), b = point(), c = point(), d = point();
      expectRight(a, b, c, d);
      zeros += verify::orientation(a, b, c, d) == 0;
    }
    EXPECT_GT(zeros, 0) << unit;
  }
}

TEST(ExactSign, NearlyFlatTetrahedraAgreeWithTheLibrary) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::uniform_int_distribution<int> step(-2, 2);
  const auto nudged = [&](double x) {
    const int n = step(random);
    for (int i = 0; i < std::abs(n); ++i) x = std::nextafter(x, n > 0 ? 2 : -2);
    return x;
  };
  int counts[3] = {0, 0, 0};
  for (int i = 0; i < 3000; ++i) {
    const auto point = [&] { return Point{uniform(random), uniform(random), uniform(random)}; };
    const Point a = point(), b = point(), c = point();
    const double u = uniform(random), v = uniform(random);
    const Point flat = a + u * (b - a) + v * (c - a);
    const Point d{nudged(flat.x), nudged(flat.y), nudged(flat.z)};
    const int sign = verify::orientation(a, b, c, d);
    EXPECT_EQ(sign, orient3d(toEigen(a), toEigen(b), toEigen(c), toEigen(d)));
    if (i % 10 == 0) {
      EXPECT_EQ(sign, rationalOrientation(a, b, c, d));
    }
    const Point e = u * a + v * b;
    const Point w{nudged(e.x), nudged(e.y), nudged(e.z)};
    EXPECT_EQ(verify::signOfDeterminant(a, b, w), orientDirections(toEigen(a), toEigen(b), toEigen(w)));
    ++counts[sign + 1];
  }
  EXPECT_GT(counts[0], 500);
  EXPECT_GT(counts[2], 500);
}

}  // namespace
}  // namespace polestar::testing
