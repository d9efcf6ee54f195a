#pragma once
// Inverse square root, logarithm and arc tangent for loops that the compiler vectorizes: branch-free, made of
// operations that every SIMD level has. Files that use the latter two in such loops need -fno-trapping-math,
// or the selections stay branches.

#include <cstdint>

#include "polestar/core/detail/simd.h"

namespace polestar::detail {

/// 1/sqrt(a) for normal numbers a > 0, within 2 units in the last place; large and finite for 0. Sums over
/// pairs wait for roots and quotients: multiplications alone are twice as fast with AVX2.
POLESTAR_INTO_CLONES double inverseRoot(double a) {
  // Half the negative of the bits is within 3.5 % [Lomont 2003]; the two steps, of order 4, leave 6e-6, then
  // rounding.
  double y = __builtin_bit_cast(double, 0x5fe6'eb50'c7b5'37a9 - (__builtin_bit_cast(std::uint64_t, a) >> 1));
  for (int step = 0; step < 2; ++step) {
    const double h = 1 - a * y * y;
    y += y * (h * (0.5 + h * (0.375 + h * 0.3125)));
  }
  return y;
}

/// The same for lanes, in place. (Functions that return them would depend on the instruction set.)
template <class V>
POLESTAR_INTO_CLONES void invertRoots(V& a) {
  using Bits [[gnu::vector_size(sizeof(V))]] = std::uint64_t;  // differences may wrap
  V y = reinterpret_cast<V>(0x5fe6'eb50'c7b5'37a9 - (reinterpret_cast<Bits>(a) >> 1));
  for (int step = 0; step < 2; ++step) {
    const V h = 1 - a * y * y;
    y += y * (h * (0.5 + h * (0.375 + h * 0.3125)));
  }
  a = y;
}

/// log(a / b) for normal numbers a >= b > 0, within 4 units in the last place.
POLESTAR_INTO_CLONES double logOfRatio(double a, double b) {
  // The bits of a double are roughly its binary logarithm: their difference, rounded to a whole exponent, is
  // a power of two that brings the ratio within 2^0.59 of 1.
  constexpr std::uint64_t kExponent = 0xfff0'0000'0000'0000, kHalf = 0x0008'0000'0000'0000;
  const auto bitsOfA = __builtin_bit_cast(std::uint64_t, a), bitsOfB = __builtin_bit_cast(std::uint64_t, b);
  const std::uint64_t power = (bitsOfA - bitsOfB + kHalf) & kExponent;
  const double scaled = __builtin_bit_cast(double, bitsOfA - power);
  // Integer to double: as the mantissa of 2^52 + power (AVX2 has no conversion from 64 bits).
  constexpr std::uint64_t kBitsOfTwoTo52 = 0x4330'0000'0000'0000;
  const double exponent = __builtin_bit_cast(double, (power >> 52) | kBitsOfTwoTo52) - 0x1p52;
  // log(ratio) = 2 artanh(s), s = (ratio - 1)/(ratio + 1); artanh(s)/s = 1 + z p(z), z = s^2 <= 0.0403, p a
  // Chebyshev fit: relative error 6e-17.
  const double s = (scaled - b) / (scaled + b), z = s * s, z2 = z * z, z4 = z2 * z2;
  const double p = (0.33333333333333476 + 0.19999999999657492 * z) +
                   z2 * (0.14285714421441292 + 0.11111090979536245 * z) +
                   z4 * ((0.09092326940775801 + 0.0764132067982866 * z) + z2 * 0.07564052597042638);
  constexpr double kLogOf2 = 0.6931471805599453;
  return exponent * kLogOf2 + 2 * (s + s * (z * p));
}

/// Angle of the point (x, y) with the positive x-axis, y >= 0: in [0, pi], within 4 units in the last place.
/// Finite at the origin.
POLESTAR_INTO_CLONES double upperHalfAngle(double y, double x) {
  // Turned by 0, 45 or 90 degrees, so that the tangent that is left is at most tan(pi/8).
  constexpr double kTangent = 0.41421356237309503, kHalfPi = 1.5707963267948966, kPi = 3.141592653589793;
  constexpr double kTiny = 1e-300;
  const double absX = x < 0 ? -x : x;
  const bool low = y <= kTangent * absX, high = kTangent * y > absX;
  const double base = low ? 0.0 : (high ? kHalfPi : 0.5 * kHalfPi);
  const double numerator = low ? y : (high ? -absX : y - absX);
  const double denominator = low ? absX : (high ? y : y + absX);
  const double t = numerator / (denominator > kTiny ? denominator : kTiny);
  // arctan(t)/t = 1 + z p(z), z = t^2 <= 0.1716, p a Chebyshev fit: relative error 6e-18.
  const double z = t * t, z2 = z * z, z4 = z2 * z2, z8 = z4 * z4;
  const double p = ((-0.3333333333333333 + 0.1999999999999552 * z) +
                    z2 * (-0.14285714284666542 + 0.11111111015256292 * z)) +
                   z4 * ((-0.09090904578121085 + 0.07692183190760651 * z) +
                         z2 * (-0.0666451144646022 + 0.05858148904795124 * z)) +
                   z8 * ((-0.050854496960392584 + 0.039231657085083686 * z) + z2 * -0.019176885636589053);
  const double angle = base + (t + t * (z * p));
  return x < 0 ? kPi - angle : angle;
}

}  // namespace polestar::detail
