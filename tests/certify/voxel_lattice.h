#pragma once
// A block of voxels whose samples are a map's, all of them deep inside: what voxels are judged and mended on.

#include <cstdint>
#include <functional>
#include <vector>

#include "polestar/certify/voxel_cells.h"

namespace polestar::testing {

inline constexpr int kSize = 24;

/// Voxels of size 1, the origin in their middle.
struct Lattice {
  std::vector<Vec3f> rest;
  std::vector<float> distance = std::vector<float>(kSize * kSize * kSize, -100.0F);
  std::vector<std::uint8_t> active = std::vector<std::uint8_t>(kSize * kSize * kSize, 1);

  explicit Lattice(const std::function<Vec3(const Vec3&)>& map) {
    for (int i = 0; i < kSize; ++i) {
      for (int j = 0; j < kSize; ++j) {
        for (int k = 0; k < kSize; ++k)
          rest.push_back(map(Vec3(i, j, k) - Vec3::Constant(0.5 * (kSize - 1))).cast<float>());
      }
    }
  }
  VoxelBlock block() const { return {kSize, rest, distance, active, 1}; }
  static std::size_t at(int i, int j, int k) { return (static_cast<std::size_t>(i) * kSize + j) * kSize + k; }
};

}  // namespace polestar::testing
