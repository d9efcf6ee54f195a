#include "exact_sign.h"

#include <algorithm>
#include <array>
#include <climits>
#include <cstdint>
#include <vector>

namespace polestar::verify {
namespace {

/// A whole number of any length: sign and magnitude, least digit first, no leading zeros.
class Integer {
 public:
  Integer() = default;
  /// mantissa * 2^shift
  Integer(std::int64_t mantissa, unsigned shift) : negative_(mantissa < 0) {
    std::uint64_t bits =
        negative_ ? 0 - static_cast<std::uint64_t>(mantissa) : static_cast<std::uint64_t>(mantissa);
    digits_.assign(shift / kBits, 0);
    const unsigned rest = shift % kBits;
    digits_.push_back(static_cast<std::uint32_t>(bits << rest));
    for (bits >>= kBits - rest; bits != 0; bits >>= kBits)
      digits_.push_back(static_cast<std::uint32_t>(bits));
    trim();
  }

  int sign() const { return digits_.empty() ? 0 : negative_ ? -1 : 1; }

  friend Integer operator-(const Integer& a, const Integer& b) {
    Integer minusB = b;
    minusB.negative_ = !b.negative_;
    return a + minusB;
  }
  friend Integer operator+(const Integer& a, const Integer& b) {
    if (a.negative_ == b.negative_) return sum(a, b);
    return isSmaller(a, b) ? difference(b, a) : difference(a, b);
  }
  friend Integer operator*(const Integer& a, const Integer& b) {
    Integer result;
    result.negative_ = a.negative_ != b.negative_;
    result.digits_.assign(a.digits_.size() + b.digits_.size(), 0);
    for (std::size_t i = 0; i < a.digits_.size(); ++i) {
      std::uint64_t carry = 0;
      for (std::size_t j = 0; j < b.digits_.size(); ++j) {
        carry += result.digits_[i + j] + static_cast<std::uint64_t>(a.digits_[i]) * b.digits_[j];
        result.digits_[i + j] = static_cast<std::uint32_t>(carry);
        carry >>= kBits;
      }
      result.digits_[i + b.digits_.size()] = static_cast<std::uint32_t>(carry);
    }
    result.trim();
    return result;
  }

 private:
  static constexpr unsigned kBits = 32;

  std::uint64_t digit(std::size_t i) const { return i < digits_.size() ? digits_[i] : 0; }
  void trim() {
    while (!digits_.empty() && digits_.back() == 0) digits_.pop_back();
  }
  /// By magnitude.
  static bool isSmaller(const Integer& a, const Integer& b) {
    if (a.digits_.size() != b.digits_.size()) return a.digits_.size() < b.digits_.size();
    return std::lexicographical_compare(a.digits_.rbegin(), a.digits_.rend(), b.digits_.rbegin(),
                                        b.digits_.rend());
  }
  static Integer sum(const Integer& a, const Integer& b) {
    Integer result;
    result.negative_ = a.negative_;
    std::uint64_t carry = 0;
    for (std::size_t i = 0; i < std::max(a.digits_.size(), b.digits_.size()) + 1; ++i) {
      carry += a.digit(i) + b.digit(i);
      result.digits_.push_back(static_cast<std::uint32_t>(carry));
      carry >>= kBits;
    }
    result.trim();
    return result;
  }
  /// |a| - |b| with the sign of a; |a| >= |b|.
  static Integer difference(const Integer& a, const Integer& b) {
    Integer result;
    result.negative_ = a.negative_;
    std::uint64_t borrow = 0;
    for (std::size_t i = 0; i < a.digits_.size(); ++i) {
      const std::uint64_t d = a.digit(i) - b.digit(i) - borrow;
      result.digits_.push_back(static_cast<std::uint32_t>(d));
      borrow = d >> 63;
    }
    result.trim();
    return result;
  }

  bool negative_ = false;
  std::vector<std::uint32_t> digits_;
};

using Integer3 = std::array<Integer, 3>;

Integer3 operator-(const Integer3& a, const Integer3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

int signOf(const Integer3& a, const Integer3& b, const Integer3& c) {
  Integer total;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    total = total + a[k] * (b[i] * c[j] - b[j] * c[i]);
  }
  return total.sign();
}

/// The points times one power of two that makes all coordinates whole.
template <std::size_t N>
std::array<Integer3, N> toIntegers(const std::array<Vec3, N>& points) {
  constexpr int kMantissa = 53;
  int least = INT_MAX, exponent = 0;
  for (const Vec3& p : points) {
    for (int k = 0; k < 3; ++k) {
      if (p[k] == 0) continue;
      std::frexp(p[k], &exponent);
      least = std::min(least, exponent);
    }
  }
  std::array<Integer3, N> result;
  for (std::size_t i = 0; i < N; ++i) {
    for (int k = 0; k < 3; ++k) {
      if (points[i][k] == 0) continue;
      const double mantissa = std::ldexp(std::frexp(points[i][k], &exponent), kMantissa);
      result[i][k] = Integer(static_cast<std::int64_t>(mantissa), static_cast<unsigned>(exponent - least));
    }
  }
  return result;
}

/// Sign of det[a, b, c] when rounding cannot have changed it, else 0. Each entry may carry one rounding.
int filteredSign(const Vec3& a, const Vec3& b, const Vec3& c) {
  double largest = 0;
  for (const Vec3* v : {&a, &b, &c}) {
    largest = std::max({largest, std::abs(v->x), std::abs(v->y), std::abs(v->z)});
  }
  // Nothing overflows below that; and what underflow takes from a product, at most 5e-324, has been
  // multiplied by less than that once, so kTiny covers all of it.
  constexpr double kLargest = 1e90, kTiny = 1e-220;
  if (!(largest < kLargest)) return 0;
  double value = 0, permanent = 0;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    value += a[k] * (b[i] * c[j] - b[j] * c[i]);
    permanent += std::abs(a[k]) * (std::abs(b[i] * c[j]) + std::abs(b[j] * c[i]));
  }
  // Three roundings of entries, four of products and minors, two of the sum: nine half ulps to first order.
  constexpr double kBound = 16 * 1.1102230246251565e-16;
  if (!(std::abs(value) > kBound * permanent + kTiny)) return 0;
  return value > 0 ? 1 : -1;
}

}  // namespace

int signOfDeterminant(const Vec3& a, const Vec3& b, const Vec3& c) {
  if (const int sign = filteredSign(a, b, c)) return sign;
  const auto p = toIntegers<3>({a, b, c});
  return signOf(p[0], p[1], p[2]);
}

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  if (const int sign = filteredSign(b - a, c - a, d - a)) return sign;
  const auto p = toIntegers<4>({a, b, c, d});
  return signOf(p[1] - p[0], p[2] - p[0], p[3] - p[0]);
}

}  // namespace polestar::verify
