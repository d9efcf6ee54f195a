#include "polestar/render/detail/sampling.h"

#include <cmath>

#include "polestar/core/detail/simd.h"

namespace polestar::detail {
namespace {

POLESTAR_INTO_CLONES std::uint32_t reverseBits(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

/// Nested uniform scramble of the bits of the reversed number, the least significant first [Burley 2020,
/// after Laine and Karras].
POLESTAR_INTO_CLONES std::uint32_t scrambleReversed(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return x;
}

/// Second dimension of Sobol's sequence, bits reversed: bit j is the parity of the index's bits at places k
/// with C(k, j) odd, that is j a subset of k, bitwise.
POLESTAR_INTO_CLONES std::uint32_t sobolSecondReversed(std::uint32_t index) {
  index ^= (index & 0xaaaaaaaau) >> 1;
  index ^= (index & 0xccccccccu) >> 2;
  index ^= (index & 0xf0f0f0f0u) >> 4;
  index ^= (index & 0xff00ff00u) >> 8;
  return index ^ (index >> 16);
}

POLESTAR_INTO_CLONES float unitFloat(std::uint32_t x) {
  return static_cast<float>(static_cast<std::int32_t>(x >> 8)) * 0x1p-24f;
}

struct Seeds {
  std::uint32_t shuffle, first, second;
  Seeds(std::uint32_t pixel, std::uint32_t stream)
      : shuffle(hash(pixel + 0x9e3779b9u * (stream + 1))),
        first(hash(shuffle ^ 0x68bc21ebu)),
        second(hash(shuffle ^ 0x02e5be93u)) {}
};

POLESTAR_INTO_CLONES void squarePoint(std::uint32_t index, const Seeds& seeds, float& u, float& v) {
  // As a number, an index keeps its leading bits: aligned blocks of powers of two go to such blocks, permuted
  // inside.
  const std::uint32_t shuffled = reverseBits(scrambleReversed(reverseBits(index), seeds.shuffle));
  u = unitFloat(reverseBits(scrambleReversed(shuffled, seeds.first)));
  v = unitFloat(reverseBits(scrambleReversed(sobolSecondReversed(shuffled), seeds.second)));
}

/// sin(2 pi t), |t| <= 1/4, within 1e-7.
POLESTAR_INTO_CLONES float sineOfTurns(float t) {
  const float x = 6.2831853f * t, z = x * x;
  return x *
         (1 + z * (-1.6666667e-1f +
                   z * (8.3333333e-3f + z * (-1.9841270e-4f + z * (2.7557319e-6f + z * -2.5052108e-8f)))));
}

POLESTAR_INTO_CLONES float tent(float u) {
  const float low = std::sqrt(2 * u) - 1, high = 1 - std::sqrt(2 - 2 * u);
  return u < 0.5f ? low : high;
}

}  // namespace

POLESTAR_SIMD_CLONES
void squarePoints(const PixelSamples& pixel, std::uint32_t stream, std::size_t count, float* u, float* v) {
  const Seeds seeds(pixel.seed, stream);
  const std::uint32_t start = pixel.first;
  for (std::size_t i = 0; i < count; ++i)
    squarePoint(start + static_cast<std::uint32_t>(i), seeds, u[i], v[i]);
}

POLESTAR_SIMD_CLONES
void diskPoints(const PixelSamples& pixel, std::uint32_t stream, std::size_t count, float* x, float* y) {
  const Seeds seeds(pixel.seed, stream);
  const std::uint32_t start = pixel.first;
  for (std::size_t i = 0; i < count; ++i) {
    float u, v;
    squarePoint(start + static_cast<std::uint32_t>(i), seeds, u, v);
    const float radius = std::sqrt(u), turns = v - 0.5f, size = turns < 0 ? -turns : turns;
    const float folded = size > 0.25f ? 0.5f - size : size;
    x[i] = radius * sineOfTurns(0.25f - size);
    y[i] = radius * sineOfTurns(turns < 0 ? -folded : folded);
  }
}

POLESTAR_SIMD_CLONES
void tentPoints(const PixelSamples& pixel, std::uint32_t stream, std::size_t count, float* x, float* y) {
  const Seeds seeds(pixel.seed, stream);
  const std::uint32_t start = pixel.first;
  for (std::size_t i = 0; i < count; ++i) {
    float u, v;
    squarePoint(start + static_cast<std::uint32_t>(i), seeds, u, v);
    x[i] = tent(u);
    y[i] = tent(v);
  }
}

}  // namespace polestar::detail
