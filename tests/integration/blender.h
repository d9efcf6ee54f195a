#pragma once
// Debian's Blender, headless, as a second opinion on what our files show.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "integration/cut_view.h"

namespace polestar::test {

/// A picture of the thin slab around a view's plane. `out` is a name in the job's folder.
struct BlenderCut {
  enum class Shader {
    emission,   ///< shines in the color scale * attribute + offset
    principled  ///< Blender's Principled Volume in the attribute's color
  };

  std::string out, attribute;
  CutView view;
  Shader shader = Shader::emission;
  double scale = 1, offset = 0;
  /// Blender puts volumes half a voxel too far on every axis. By so many voxels the camera goes along.
  double voxelsTooFar = 0.5;
};

/// Of the slab where `density` is 1, in a Principled Volume: most of its light comes from the first third.
inline constexpr double kFogOpticalDepth = 3;

struct BlenderJob {
  std::filesystem::path folder;  ///< for all that Blender writes
  std::filesystem::path vdb;
  double voxelSize = 0;
  std::map<std::string, std::string>
      grids;  ///< that must be there: names and Blender's words for their types
  std::vector<BlenderCut> cuts;
};

struct BlenderOutcome {
  int exitCode;  ///< 3: the script found the file not as it should be
  std::string log;
};

bool haveBlender();
BlenderOutcome runBlender(const BlenderJob& job);

}  // namespace polestar::test

#define POLESTAR_REQUIRE_BLENDER() \
  if (!polestar::test::haveBlender()) GTEST_SKIP() << "blender is not installed"
