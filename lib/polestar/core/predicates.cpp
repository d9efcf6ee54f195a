#include "polestar/core/predicates.h"

#include <array>
#include <cmath>
#include <limits>

// This file must be compiled without contraction and without unsafe math: error-free transformations depend
// on every rounding happening where it is written (see CMakeLists.txt of this folder).

namespace polestar {
namespace {

constexpr double kHalfUlp = 0.5 * std::numeric_limits<double>::epsilon();

struct TwoTerms {
  double high, low;
};

// a + b = high + low without error [Knuth].
TwoTerms twoSum(double a, double b) {
  const double high = a + b;
  const double bVirtual = high - a;
  return {high, (a - (high - bVirtual)) + (b - bVirtual)};
}

// a * b = high + low without error, as long as nothing underflows.
TwoTerms twoProduct(double a, double b) {
  const double high = a * b;
  return {high, std::fma(a, b, -high)};
}

/// A sum of at most `Capacity` doubles that do not overlap, ascending in magnitude, zeros dropped [Shewchuk
/// 1997].
template <int Capacity>
struct Expansion {
  std::array<double, Capacity> term;
  int size = 0;

  // Grow-expansion: adds one double.
  void add(double value) {
    double carry = value;
    int kept = 0;
    for (int i = 0; i < size; ++i) {
      const TwoTerms sum = twoSum(carry, term[i]);
      carry = sum.high;
      if (sum.low != 0) term[kept++] = sum.low;
    }
    if (carry != 0) term[kept++] = carry;
    size = kept;
  }

  template <int N>
  void add(const Expansion<N>& other, double sign = 1) {
    for (int i = 0; i < other.size; ++i) add(sign * other.term[i]);
  }

  // The largest term dominates the sum of the others.
  int sign() const { return size == 0 ? 0 : (term[size - 1] > 0 ? 1 : -1); }
};

Expansion<2> difference(double a, double b) {
  const TwoTerms d = twoSum(a, -b);
  Expansion<2> e;
  e.add(d.low);
  e.add(d.high);
  return e;
}

template <int N, int M>
Expansion<2 * N * M> product(const Expansion<N>& a, const Expansion<M>& b) {
  Expansion<2 * N * M> result;
  for (int i = 0; i < a.size; ++i) {
    for (int j = 0; j < b.size; ++j) {
      const TwoTerms p = twoProduct(a.term[i], b.term[j]);
      result.add(p.low);
      result.add(p.high);
    }
  }
  return result;
}

// Sign of the determinant with rows u, v, w, each entry an expansion of one or two terms.
template <int N>
int exactDeterminantSign(const std::array<Expansion<N>, 3>& u, const std::array<Expansion<N>, 3>& v,
                         const std::array<Expansion<N>, 3>& w) {
  Expansion<3 * 8 * N * N * N> sum;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    Expansion<4 * N* N> minor = [&] {
      Expansion<4 * N * N> m;
      m.add(product(v[i], w[j]));
      m.add(product(v[j], w[i]), -1);
      return m;
    }();
    sum.add(product(u[k], minor));
  }
  return sum.sign();
}

// The determinant with rows u, v, w and its permanent of absolute values.
struct Determinant {
  double value, permanent;
};
Determinant roundedDeterminant(const Vec3& u, const Vec3& v, const Vec3& w) {
  const double vw0 = v[1] * w[2], wv0 = v[2] * w[1];
  const double vw1 = v[2] * w[0], wv1 = v[0] * w[2];
  const double vw2 = v[0] * w[1], wv2 = v[1] * w[0];
  return {u[0] * (vw0 - wv0) + u[1] * (vw1 - wv1) + u[2] * (vw2 - wv2),
          std::abs(u[0]) * (std::abs(vw0) + std::abs(wv0)) +
              std::abs(u[1]) * (std::abs(vw1) + std::abs(wv1)) +
              std::abs(u[2]) * (std::abs(vw2) + std::abs(wv2))};
}

int signOf(double x) { return (x > 0) - (x < 0); }

}  // namespace

int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  // Error bound "A" of Shewchuk's orient3d: the differences are rounded once, then three products deep.
  constexpr double kErrorBound = (7 + 56 * kHalfUlp) * kHalfUlp;
  const Determinant det = roundedDeterminant(b - a, c - a, d - a);
  if (std::abs(det.value) > kErrorBound * det.permanent) return signOf(det.value);

  std::array<Expansion<2>, 3> u, v, w;
  for (int k = 0; k < 3; ++k) {
    u[k] = difference(b[k], a[k]);
    v[k] = difference(c[k], a[k]);
    w[k] = difference(d[k], a[k]);
  }
  return exactDeterminantSign(u, v, w);
}

int orientDirections(const Vec3& a, const Vec3& b, const Vec3& c) {
  constexpr double kErrorBound = (7 + 56 * kHalfUlp) * kHalfUlp;  // no differences here: generous
  const Determinant det = roundedDeterminant(a, b, c);
  if (std::abs(det.value) > kErrorBound * det.permanent) return signOf(det.value);

  std::array<Expansion<1>, 3> u, v, w;
  for (int k = 0; k < 3; ++k) {
    u[k].add(a[k]);
    v[k].add(b[k]);
    w[k].add(c[k]);
  }
  return exactDeterminantSign(u, v, w);
}

}  // namespace polestar
