#pragma once
// Sample points that depend on pixel and sample number alone: the same picture for any number of threads.

#include <Eigen/Core>
#include <cstdint>

namespace polestar::detail {

inline std::uint32_t reverseBits(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

/// Integer hash with full avalanche (the finalizer of MurmurHash3).
inline std::uint32_t hash(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

/// Nested uniform scramble of the bits of `x`, the most significant first [Burley 2020, "Practical hash-based
/// Owen scrambling", after Laine and Karras].
inline std::uint32_t owenScramble(std::uint32_t x, std::uint32_t seed) {
  x = reverseBits(x);
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return reverseBits(x);
}

/// Second dimension of Sobol's sequence.
inline std::uint32_t sobolSecond(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t direction = 1u << 31; index; index >>= 1, direction ^= direction >> 1) {
    if (index & 1) result ^= direction;
  }
  return result;
}

/// Point `index` of stream `stream` in the unit square: an Owen-scrambled, shuffled (0, 2)-sequence, so each
/// stream is stratified for itself and independent of the others.
inline Eigen::Vector2d samplePoint(std::uint32_t pixelSeed, std::uint32_t stream, std::uint32_t index) {
  const std::uint32_t seed = hash(pixelSeed + 0x9e3779b9u * (stream + 1));
  // As a number, an index keeps its leading bits: aligned blocks of powers of two go to such blocks, permuted
  // inside.
  const std::uint32_t shuffled = owenScramble(index, seed);
  const std::uint32_t x = owenScramble(reverseBits(shuffled), hash(seed ^ 0x68bc21ebu));
  const std::uint32_t y = owenScramble(sobolSecond(shuffled), hash(seed ^ 0x02e5be93u));
  return {x * 0x1p-32, y * 0x1p-32};
}

}  // namespace polestar::detail
