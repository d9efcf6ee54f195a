#include "polestar/core/predicates.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace polestar {
namespace {

constexpr double kHalfUlp = 0.5 * std::numeric_limits<double>::epsilon();

__extension__ using Wide = unsigned __int128;

/// A finite double as an integer times a power of two.
struct Parts {
  explicit Parts(double x) {
    constexpr std::uint64_t kHidden = std::uint64_t{1} << 52;
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const auto field = static_cast<int>((bits >> 52) & 0x7ff);
    negative = (bits >> 63) != 0;
    mantissa = (bits & (kHidden - 1)) | (field > 0 ? kHidden : 0);
    exponent = std::max(field, 1) - 1075;
  }
  bool negative;
  std::uint64_t mantissa;
  int exponent;
};

/// Sums products of three finite doubles without rounding: two fixed-point numbers as long as all such
/// products need, one for what is added and one for what is taken away. [Kulisch 1971]
class ExactSum {
 public:
  void add(double a, double b, double c, int sign) {
    const Parts x(a), y(b), z(c);
    const bool negative = (x.negative != y.negative) != (z.negative != (sign < 0));
    const Wide two = Wide{x.mantissa} * y.mantissa;
    const Wide low = Wide{static_cast<std::uint64_t>(two)} * z.mantissa;
    const Wide high = (two >> 64) * z.mantissa + (low >> 64);
    const std::array<std::uint64_t, 3> product{static_cast<std::uint64_t>(low),
                                               static_cast<std::uint64_t>(high),
                                               static_cast<std::uint64_t>(high >> 64)};
    const int shift = x.exponent + y.exponent + z.exponent - kLeastExponent;
    Words& words = negative ? taken_ : added_;
    Wide carry = 0;
    auto word = static_cast<std::size_t>(shift / 64);
    for (std::size_t i = 0; i < product.size() || carry != 0; ++i, ++word) {
      carry += words[word];
      if (i < product.size()) carry += Wide{product[i]} << shift % 64;
      words[word] = static_cast<std::uint64_t>(carry);
      carry >>= 64;
    }
  }

  int sign() const {
    for (std::size_t i = kWords; i-- > 0;) {
      if (added_[i] != taken_[i]) return added_[i] > taken_[i] ? 1 : -1;
    }
    return 0;
  }

 private:
  static constexpr int kLeastExponent = 3 * -1074;
  // From 2^-3222 to 64 products below 2^3072.
  static constexpr std::size_t kWords = 100;
  using Words = std::array<std::uint64_t, kWords>;
  Words added_{}, taken_{};
};

void addDeterminant(ExactSum& sum, const Vec3& a, const Vec3& b, const Vec3& c, int sign) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    sum.add(a[k], b[i], c[j], sign);
    sum.add(a[k], b[j], c[i], -sign);
  }
}

/// Sign of the determinant with rows u, v, w, each entry rounded once; 0 where rounding may have changed it.
int filteredSign(const Vec3& u, const Vec3& v, const Vec3& w) {
  const double vw0 = v[1] * w[2], wv0 = v[2] * w[1];
  const double vw1 = v[2] * w[0], wv1 = v[0] * w[2];
  const double vw2 = v[0] * w[1], wv2 = v[1] * w[0];
  const double value = u[0] * (vw0 - wv0) + u[1] * (vw1 - wv1) + u[2] * (vw2 - wv2);
  const double u0 = std::abs(u[0]), u1 = std::abs(u[1]), u2 = std::abs(u[2]);
  const double permanent = u0 * (std::abs(vw0) + std::abs(wv0)) + u1 * (std::abs(vw1) + std::abs(wv1)) +
                           u2 * (std::abs(vw2) + std::abs(wv2));
  // Error bound "A" of Shewchuk's orient3d: the entries are rounded once, then three products deep. What
  // underflow takes from a product is at most 2^-1075: from two in each minor, which u then multiplies, and
  // from three at the end; the bound for that is larger, since numbers below 2^-1022 are slow. Where
  // something overflows the bound is no number and nothing is decided.
  constexpr double kErrorBound = (7 + 56 * kHalfUlp) * kHalfUlp;
  constexpr double kUnderflow = 0x1p-1000;
  if (!(std::abs(value) > kErrorBound * permanent + kUnderflow * (1 + u0 + u1 + u2))) return 0;
  return value > 0 ? 1 : -1;
}

}  // namespace

int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  if (const int sign = filteredSign(b - a, c - a, d - a)) return sign;
  if (!(a.allFinite() && b.allFinite() && c.allFinite() && d.allFinite())) return 0;
  ExactSum sum;
  addDeterminant(sum, b, c, d, 1);
  addDeterminant(sum, a, c, d, -1);
  addDeterminant(sum, a, b, d, 1);
  addDeterminant(sum, a, b, c, -1);
  return sum.sign();
}

int orientDirections(const Vec3& a, const Vec3& b, const Vec3& c) {
  if (const int sign = filteredSign(a, b, c)) return sign;
  if (!(a.allFinite() && b.allFinite() && c.allFinite())) return 0;
  ExactSum sum;
  addDeterminant(sum, a, b, c, 1);
  return sum.sign();
}

}  // namespace polestar
