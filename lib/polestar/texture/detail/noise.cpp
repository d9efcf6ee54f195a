#include "polestar/texture/detail/noise.h"

#include <array>

namespace polestar::detail {
namespace {

// Of the sum of kernels; measured.
constexpr double kAmplitude = 276.95;
// Lattice units per unit of the noise, so that features have about one unit.
constexpr double kLatticeScale = 0.9;

/// Share of an octave below which it is left to its mean, 0.
constexpr double kNegligible = 0.01;

/// Each component uniform in [-1, 1], so that their mean is 0 and no direction is preferred to second order.
Vec3 latticeGradient(std::uint32_t hash) {
  constexpr double half = 1023 / 2.0;
  return {(hash & 1023) / half - 1, ((hash >> 10) & 1023) / half - 1, ((hash >> 20) & 1023) / half - 1};
}

}  // namespace

NoiseValue simplexNoise(const Vec3& p, std::uint32_t seed) {
  // The lattice of cubes, sheared along its diagonal, has six equal tetrahedra a cube.
  const Vec3 q = kLatticeScale * p;
  const double skew = (q[0] + q[1] + q[2]) / 3;
  const Vec3 cell((q[0] + skew), (q[1] + skew), (q[2] + skew));
  const std::array<std::int32_t, 3> base = {static_cast<std::int32_t>(std::floor(cell[0])),
                                            static_cast<std::int32_t>(std::floor(cell[1])),
                                            static_cast<std::int32_t>(std::floor(cell[2]))};
  const double unskew = (double(base[0]) + base[1] + base[2]) / 6;
  const Vec3 first(q[0] - base[0] + unskew, q[1] - base[1] + unskew, q[2] - base[2] + unskew);

  // The tetrahedron's corners: steps along the axes, the longest component first.
  const int xy = first[0] >= first[1], xz = first[0] >= first[2], yz = first[1] >= first[2];
  const std::array<int, 3> rank = {2 - xy - xz, 1 + xy - yz, xz + yz};
  NoiseValue sum{0, Vec3::Zero()};
  for (int corner = 0; corner < 4; ++corner) {
    const std::array<int, 3> step = {rank[0] < corner, rank[1] < corner, rank[2] < corner};
    const double shift = corner / 6.0;
    const Vec3 d(first[0] - step[0] + shift, first[1] - step[1] + shift, first[2] - step[2] + shift);
    const double kernel = 0.5 - d.squaredNorm();
    if (kernel <= 0) continue;
    const Vec3 g =
        latticeGradient(latticeHash(base[0] + step[0], base[1] + step[1], base[2] + step[2], seed));
    const double squared = kernel * kernel, along = g.dot(d);
    sum.value += squared * squared * along;
    sum.gradient += squared * squared * g - (8 * kernel * squared * along) * d;
  }
  return {kAmplitude * sum.value, kAmplitude * kLatticeScale * sum.gradient};
}

namespace {

/// `amplitude` times noise at `frequency`, filtered, added to `sum`.
void addOctave(const VaryingPoint& p, const Footprint& footprint, double frequency, double amplitude,
               std::uint32_t seed, NoiseValue& sum, double& variance) {
  const double kept = footprint.kept(kNoiseSpread * frequency);
  // Near 1 the gradient tells how the octave varies over the footprint; near 0 all its variance is lost.
  const double lost = 1 - kept * kept;
  variance += amplitude * amplitude * lost * lost;
  if (kept < kNegligible) return;
  const NoiseValue octave = simplexNoise(frequency * p.value(), seed);
  sum.value += kept * amplitude * octave.value;
  sum.gradient += kept * amplitude * frequency * octave.gradient;
}

}  // namespace

Varying noise(const VaryingPoint& p, const Footprint& footprint, std::uint32_t seed) {
  return fractalNoise(p, footprint, {1, 1}, seed);
}

Varying fractalNoise(const VaryingPoint& p, const Footprint& footprint, const Octaves& octaves,
                     std::uint32_t seed) {
  double power = 0, amplitude = 1;
  for (int i = 0; i < octaves.count; ++i, amplitude *= octaves.gain) power += amplitude * amplitude;
  NoiseValue sum{0, Vec3::Zero()};
  double variance = 0, frequency = 1;
  amplitude = 1 / std::sqrt(power);
  for (int i = 0; i < octaves.count; ++i, amplitude *= octaves.gain, frequency *= 2) {
    // Octaves with lattices that coincide would show it: each has its own seed.
    addOctave(p, footprint, frequency, amplitude, seed + 0x632be5abu * i, sum, variance);
  }
  Varying result = p.pull(sum.value, sum.gradient);
  result.variance += variance;
  return result;
}

}  // namespace polestar::detail
