#pragma once
// Random numbers that belong to places rather than to an order of calls.

#include <cstdint>

#include "polestar/core/detail/simd.h"

namespace polestar::detail {

/// Integer hash with full avalanche [Wellons, lowbias32]. Of an unsigned integer or a vector of them.
template <class Unsigned>
POLESTAR_INTO_CLONES constexpr Unsigned scramble(Unsigned x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

/// Largest integer that is not above x. |x| < 2^31; without the call that std::floor is before SSE 4.1.
POLESTAR_INTO_CLONES std::int32_t floorOf(double x) {
  const auto truncated = static_cast<std::int32_t>(x);
  return truncated - (x < truncated);
}

/// Of a point of the integer lattice.
inline std::uint32_t latticeHash(std::int32_t i, std::int32_t j, std::int32_t k, std::uint32_t seed) {
  return scramble(static_cast<std::uint32_t>(i) * 0x8da6b343u ^ static_cast<std::uint32_t>(j) * 0xd8163841u ^
                  static_cast<std::uint32_t>(k) * 0xcb1ab31fu ^ scramble(seed));
}

/// Uniform in [0, 1): the n-th number that belongs to a hash.
inline double uniform(std::uint32_t hash, std::uint32_t n = 0) {
  return scramble(hash + 0x9e3779b9u * n) * 0x1p-32;
}

}  // namespace polestar::detail
