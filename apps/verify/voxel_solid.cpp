#include "voxel_solid.h"

#include <algorithm>

namespace polestar::verify {

std::vector<std::uint16_t> depths(const VoxelSolid& solid) {
  // Two sweeps over the box; the maximum norm's unit ball is the 3 x 3 x 3 block, so they are exact.
  std::vector<std::uint16_t> box(solid.slot.size(), 0);
  const auto [sx, sy, sz] = solid.strides();
  std::array<std::int64_t, 13> earlier{};
  std::size_t n = 0;
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dz = -1; dz <= 1; ++dz) {
        if (dx < 0 || (dx == 0 && (dy < 0 || (dy == 0 && dz < 0))))
          earlier[n++] = dx * sx + dy * sy + dz * sz;
      }
    }
  }
  const auto relax = [&](std::uint32_t at, int direction, unsigned start) {
    unsigned least = start;
    for (const std::int64_t offset : earlier) {
      const auto other = static_cast<std::size_t>(static_cast<std::int64_t>(at) + direction * offset);
      least = std::min<unsigned>(least, box[other] + 1u);
    }
    box[at] = static_cast<std::uint16_t>(least);
  };
  constexpr unsigned kFar = 60000;
  for (std::size_t v = 0; v < solid.count(); ++v) relax(solid.box[v], 1, kFar);
  for (std::size_t v = solid.count(); v-- > 0;) relax(solid.box[v], -1, box[solid.box[v]]);
  std::vector<std::uint16_t> result(solid.count());
  for (std::size_t v = 0; v < result.size(); ++v) result[v] = box[solid.box[v]];
  return result;
}

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at =
      std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

}  // namespace polestar::verify
