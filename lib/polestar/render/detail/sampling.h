#pragma once
// Sample points that depend on pixel and sample number alone: the same picture for any number of threads.

#include <cstddef>
#include <cstdint>

namespace polestar::detail {

/// Integer hash with full avalanche (the finalizer of MurmurHash3).
inline std::uint32_t hash(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

/// Where a pixel's samples begin: `first` points of the sequence that its block of 16 x 16 pixels shares
/// belong to pixels before it.
struct PixelSamples {
  std::uint32_t seed = 0, first = 0;
};

/// Of the pixel in column x and row y of the full picture. Pixels follow one another along a Z-curve, so the
/// samples of 2 x 2, 4 x 4 ... pixels are spread as evenly as those of one: what noise is left lies at high
/// frequencies. [Ahmed & Wonka 2020, "Screen-space blue-noise diffusion of Monte Carlo sampling error"]
inline PixelSamples pixelSamples(int x, int y, int samples) {
  std::uint32_t stride = 1, place = 0;
  while (stride < static_cast<std::uint32_t>(samples)) stride *= 2;
  for (int bit = 0; bit < 4; ++bit) {
    place |= static_cast<std::uint32_t>((x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1));
  }
  return {hash(static_cast<std::uint32_t>(y / 16) * 0x9e3779b1u + static_cast<std::uint32_t>(x / 16)),
          place * stride};
}

/// `count` points of stream `stream` in the unit square [0, 1)^2, from a pixel's first: an Owen-scrambled,
/// shuffled (0, 2)-sequence, so each stream is stratified for itself and independent of the others. Powers of
/// two are spread best. [Burley 2020, "Practical hash-based Owen scrambling"]
void squarePoints(const PixelSamples& pixel, std::uint32_t stream, std::size_t count, float* u, float* v);

/// The same, spread evenly over the unit disk.
void diskPoints(const PixelSamples& pixel, std::uint32_t stream, std::size_t count, float* x, float* y);

/// The same, spread by a tent of radius 1 along each axis.
void tentPoints(const PixelSamples& pixel, std::uint32_t stream, std::size_t count, float* x, float* y);

}  // namespace polestar::detail
