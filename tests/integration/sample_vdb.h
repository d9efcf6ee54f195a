#pragma once
// Files that the tool does not write, by OpenVDB itself.

#include <filesystem>
#include <string>
#include <vector>

namespace polestar::test {

struct SampleGrid {
  enum class Kind { scalar, vector };

  std::string name;
  Kind kind = Kind::scalar;
  bool empty = false;  ///< no voxel is active; else a cube of 8 voxels an edge is
};

void writeSample(const std::filesystem::path& vdb, const std::vector<SampleGrid>& grids);

}  // namespace polestar::test
