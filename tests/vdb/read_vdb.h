#pragma once
// A .vdb read back with OpenVDB alone, as another program would, in plain types.

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::test {

using Index = std::array<int, 3>;

struct FileGrid {
  std::string name, valueType, gridClass, vectorType, creator;
  bool halfFloats = false;
  std::array<float, 3> background{};  // scalars in [0]
  std::map<std::string, std::string> metadata;
  bool uniformLinear = false;
  double voxelSize = 0;
  Vec3 origin = Vec3::Zero();  // world position of index (0, 0, 0)
  std::size_t activeCount = 0;
  Index activeMin{}, activeMax{};
  std::function<std::array<float, 3>(const Index&)> value;
  std::function<bool(const Index&)> active;
};

/// All grids of a file, by name.
std::map<std::string, FileGrid> readVdb(const std::filesystem::path& path);

/// Calls visit for every index of the box, bounds included.
template <class Visit>
void forEachIndex(const Index& min, const Index& max, Visit&& visit) {
  for (int x = min[0]; x <= max[0]; ++x) {
    for (int y = min[1]; y <= max[1]; ++y) {
      for (int z = min[2]; z <= max[2]; ++z) visit(Index{x, y, z});
    }
  }
}

inline Vec3 toVec3(const Index& i) { return Vec3(i[0], i[1], i[2]); }

}  // namespace polestar::test
