#pragma once
// Random functions of space that are the same on every machine: smooth noise and its sums over octaves,
// filtered by the footprint.

#include <cstdint>

#include "polestar/texture/detail/footprint.h"
#include "polestar/texture/detail/varying.h"

namespace polestar::detail {

/// Integer hash with full avalanche [Wellons, lowbias32].
inline std::uint32_t scramble(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
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

/// Simplex noise [Perlin 2001] with hashed gradients: mean 0, variance 1, features of about one unit, three
/// times continuously differentiable. The variance of the result is 0: nothing is averaged out.
struct NoiseValue {
  double value;
  Vec3 gradient;
};
NoiseValue simplexNoise(const Vec3& p, std::uint32_t seed);

/// How simplexNoise varies, as Footprint::kept takes it; measured, and held by a test.
inline constexpr double kNoiseSpread = 3.1;

/// Noise at `p`, averaged over the footprint; what that averages out is in the result's variance.
/// `footprint` is of p's domain.
Varying noise(const VaryingPoint& p, const Footprint& footprint, std::uint32_t seed);

struct Octaves {
  int count = 4;
  double gain = 0.5;  ///< of each octave's amplitude over that of the one before
};

/// Sum of octaves of noise, each of twice the frequency of the one before, scaled to variance 1. Octaves that
/// the footprint averages out are not evaluated.
Varying fractalNoise(const VaryingPoint& p, const Footprint& footprint, const Octaves& octaves,
                     std::uint32_t seed);

}  // namespace polestar::detail
