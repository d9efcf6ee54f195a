#pragma once
// The voxels of a .vdb that lie inside the solid, without OpenVDB: what the judges of judge_vdb.h look at.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "domain.h"
#include "vec3.h"

namespace polestar::verify {

struct Vec3f {
  float x = 0, y = 0, z = 0;
};
inline Vec3 toDouble(const Vec3f& v) { return {v.x, v.y, v.z}; }

/// Lengths are in voxels and G is in 1/voxel throughout; places are indices within the box of the inside
/// voxels, which has one layer of outside voxels around it.
struct VoxelSolid {
  std::array<int, 3> size{};       ///< of the box
  std::array<int, 3> corner{};     ///< index in the grids of the box's voxel (0, 0, 0)
  std::vector<std::int32_t> slot;  ///< a voxel's place in the lists below, -1 outside; z fastest
  std::vector<std::uint32_t> box;  ///< the reverse
  std::vector<Vec3f> rest;
  std::vector<float> green, surface;
  bool hasGreen = true;  ///< else `green` is 0 and nothing that is said of it holds: a frame of a morph

  Domain domain;  ///< that `rest` maps onto
  Vec3 center;
  double harmonicRadius = 0, greenCap = 0;
  double coreRadius = 0;        ///< of the ball's part where iso-curves are no field lines
  bool radiusIsOfGreen = true;  ///< |rest| is 1/(1 + rho G), not another monotone function of G

  std::string transformFault;  ///< empty: all grids share one transform, a similarity that keeps orientation
  std::size_t undefinedRest = 0, undefinedGreen = 0;  ///< voxels inside without a value
  std::size_t notFiniteSurface = 0;                   ///< values of `surface`, inside or not

  std::size_t count() const { return rest.size(); }
  std::size_t boxIndex(int i, int j, int k) const {
    return (static_cast<std::size_t>(i) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size[2]) +
           static_cast<std::size_t>(k);
  }
  std::array<int, 3> placeOf(std::size_t voxel) const {
    const std::uint32_t at = box[voxel], z = static_cast<std::uint32_t>(size[2]),
                        y = static_cast<std::uint32_t>(size[1]);
    return {static_cast<int>(at / z / y), static_cast<int>(at / z % y), static_cast<int>(at % z)};
  }
  Vec3 position(std::size_t voxel) const {
    const auto p = placeOf(voxel);
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
  /// Steps in `slot` to the neighbours along x, y and z.
  std::array<std::int64_t, 3> strides() const {
    return {static_cast<std::int64_t>(size[1]) * size[2], size[2], 1};
  }
  /// The voxel `offset` further in `slot`; -1 outside. The caller knows that it is in the box.
  std::int32_t neighbour(std::size_t voxel, std::int64_t offset) const {
    return slot[static_cast<std::size_t>(static_cast<std::int64_t>(box[voxel]) + offset)];
  }

  /// G decides R; 1/(1 + rho G).
  double radiusOfGreen(std::size_t voxel) const { return 1 / (1 + harmonicRadius * green[voxel]); }
  /// Whether G was cut at the pole there.
  bool isCapped(std::size_t voxel) const { return green[voxel] >= greenCap * (1 - 1e-6); }
};

/// Largest d such that all voxels nearer than d in the maximum norm lie inside: 1 next to an outside voxel.
/// One a voxel of the solid.
std::vector<std::uint16_t> depths(const VoxelSolid& solid);

/// The value with `share` of the values below it; reorders them. 0 of none.
double quantile(std::vector<double>& values, double share);

}  // namespace polestar::verify
