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

/// Of the pixel in column x and row y of the full picture.
inline std::uint32_t pixelSeed(int x, int y) {
  return hash(static_cast<std::uint32_t>(y) * 0x9e3779b1u + static_cast<std::uint32_t>(x));
}

/// The first `count` points of stream `stream` in the unit square [0, 1)^2: an Owen-scrambled, shuffled
/// (0, 2)-sequence, so each stream is stratified for itself and independent of the others. Powers of two are
/// spread best. [Burley 2020, "Practical hash-based Owen scrambling"]
void squarePoints(std::uint32_t seed, std::uint32_t stream, std::size_t count, float* u, float* v);

/// The same, spread evenly over the unit disk.
void diskPoints(std::uint32_t seed, std::uint32_t stream, std::size_t count, float* x, float* y);

/// The same, spread by a tent of radius 1 along each axis.
void tentPoints(std::uint32_t seed, std::uint32_t stream, std::size_t count, float* x, float* y);

}  // namespace polestar::detail
