#include "polestar/texture/detail/noise.h"

#include <array>

#include "polestar/texture/detail/four_lanes.h"

namespace polestar::detail {
namespace {

// Of the sum of kernels; measured.
constexpr float kAmplitude = 276.95f;
// Lattice units per unit of the noise, so that features have about one unit.
constexpr double kLatticeScale = 0.9;

/// Share of an octave below which it is left to its mean, 0.
constexpr double kNegligible = 0.01;

/// A simplex of the lattice: the point's offset from its first corner, and which corner follows.
struct Simplex {
  std::array<std::int32_t, 3> base;
  std::array<float, 3> offset;
  /// A corner has taken its step along an axis when its number, 0 to 3, is above the axis' rank.
  std::array<std::int32_t, 3> rank;
};

/// The lattice of cubes, sheared along its diagonal, has six equal tetrahedra a cube.
POLESTAR_INTO_CLONES Simplex simplexAround(const Vec3& q) {
  const double skew = (q[0] + q[1] + q[2]) / 3;
  Simplex simplex;
  simplex.base = {floorOf(q[0] + skew), floorOf(q[1] + skew), floorOf(q[2] + skew)};
  const double unskew = (double(simplex.base[0]) + simplex.base[1] + simplex.base[2]) / 6;
  for (int axis = 0; axis < 3; ++axis) {
    simplex.offset[axis] = static_cast<float>(q[axis] - simplex.base[axis] + unskew);
  }
  // Steps go along the longest component first.
  const auto& d = simplex.offset;
  const int xy = d[0] >= d[1], xz = d[0] >= d[2], yz = d[1] >= d[2];
  simplex.rank = {2 - xy - xz, 1 + xy - yz, xz + yz};
  return simplex;
}

}  // namespace

POLESTAR_SIMD_CLONES NoiseValue simplexNoise(const Vec3& p, std::uint32_t seed) {
  const Simplex simplex = simplexAround(kLatticeScale * p);
  // All four corners at once.
  constexpr Int4 kCorner = {0, 1, 2, 3};
  constexpr Float4 kShift = {0, 1 / 6.0f, 2 / 6.0f, 3 / 6.0f};
  const Int4 stepX = kCorner > simplex.rank[0], stepY = kCorner > simplex.rank[1],
             stepZ = kCorner > simplex.rank[2];  // -1 where taken
  const Float4 x = simplex.offset[0] + toFloat(stepX) + kShift,
               y = simplex.offset[1] + toFloat(stepY) + kShift,
               z = simplex.offset[2] + toFloat(stepZ) + kShift;
  const Uint4 hash =
      latticeHash(simplex.base[0] - stepX, simplex.base[1] - stepY, simplex.base[2] - stepZ, seed);
  // Gradients: each component uniform in [-1, 1], so that their mean is 0 and no direction is preferred to
  // second order.
  constexpr float kHalf = 1023 / 2.0f;
  const Float4 gx = tenBits(hash, 0) / kHalf - 1, gy = tenBits(hash, 10) / kHalf - 1,
               gz = tenBits(hash, 20) / kHalf - 1;

  Float4 kernel = 0.5f - (x * x + y * y + z * z);
  kernel = kernel > 0 ? kernel : Float4{};
  const Float4 along = gx * x + gy * y + gz * z;
  const Float4 squared = kernel * kernel, fourth = squared * squared;
  const Float4 slope = -8 * kernel * squared * along;
  constexpr double kScale = kAmplitude * kLatticeScale;
  return {kAmplitude * sum(fourth * along),
          {kScale * sum(fourth * gx + slope * x), kScale * sum(fourth * gy + slope * y),
           kScale * sum(fourth * gz + slope * z)}};
}

namespace {

/// `amplitude` times noise at `frequency`, filtered, added to `sum`.
void addOctave(const Vec3& p, const Footprint& footprint, double frequency, double amplitude,
               std::uint32_t seed, NoiseValue& sum, double& variance) {
  const double kept = footprint.kept(kNoiseSpread * frequency);
  // Near 1 the gradient tells how the octave varies over the footprint; near 0 all its variance is lost.
  const double lost = 1 - kept * kept;
  variance += amplitude * amplitude * lost * lost;
  if (kept < kNegligible) return;
  const NoiseValue octave = simplexNoise(frequency * p, seed);
  sum.value += kept * amplitude * octave.value;
  sum.gradient += kept * amplitude * frequency * octave.gradient;
}

}  // namespace

Varying noise(const VaryingPoint& p, const Footprint& footprint, std::uint32_t seed, double frequency) {
  return fractalNoise(p, footprint, {.frequency = frequency, .count = 1, .gain = 1}, seed);
}

Varying fractalNoise(const VaryingPoint& p, const Footprint& footprint, const Octaves& octaves,
                     std::uint32_t seed) {
  double power = 0, amplitude = 1;
  for (int i = 0; i < octaves.count; ++i, amplitude *= octaves.gain) power += amplitude * amplitude;
  NoiseValue sum{0, Vec3::Zero()};
  double variance = 0, frequency = octaves.frequency;
  amplitude = 1 / std::sqrt(power);
  for (int i = 0; i < octaves.count; ++i, amplitude *= octaves.gain, frequency *= 2) {
    // Octaves with lattices that coincide would show it: each has its own seed.
    addOctave(p.value(), footprint, frequency, amplitude, seed + 0x632be5abu * i, sum, variance);
  }
  Varying result = p.pull(sum.value, sum.gradient);
  result.variance += variance;
  return result;
}

}  // namespace polestar::detail
