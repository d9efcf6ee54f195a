#pragma once
// Random functions of space that are the same on every machine: smooth noise and its sums over octaves,
// filtered by the footprint.

#include <cstdint>

#include "polestar/texture/detail/footprint.h"
#include "polestar/texture/detail/hash.h"
#include "polestar/texture/detail/varying.h"

namespace polestar::detail {

/// Simplex noise [Perlin 2001] with hashed gradients: mean 0, variance 1, features of about one unit, three
/// times continuously differentiable. The variance of the result is 0: nothing is averaged out.
struct NoiseValue {
  double value;
  Vec3 gradient;
};
NoiseValue simplexNoise(const Vec3& p, std::uint32_t seed);

/// How simplexNoise varies, as Footprint::kept takes it: of all values the one that fits means over boxes of
/// up to a wavelength best, measured.
inline constexpr double kNoiseSpread = 3.4;

/// Noise at `p`, averaged over the footprint; what that averages out is in the result's variance.
/// `footprint` is of p's domain.
Varying noise(const VaryingPoint& p, const Footprint& footprint, std::uint32_t seed, double frequency = 1);

struct Octaves {
  double frequency = 1;  ///< of the first
  int count = 4;
  double gain = 0.5;  ///< of each octave's amplitude over that of the one before
};

/// Sum of octaves of noise, each of twice the frequency of the one before, scaled to variance 1. Octaves that
/// the footprint averages out are not evaluated. `footprint` is of p's domain.
Varying fractalNoise(const VaryingPoint& p, const Footprint& footprint, const Octaves& octaves,
                     std::uint32_t seed);

}  // namespace polestar::detail
