#pragma once
// Debian's Blender, headless, as a second opinion on what our files show.

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "integration/cut_view.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::test {

/// A picture of the thin slab around a view's plane. `out` is a name in the job's folder.
struct BlenderCut {
  enum class Shader {
    emission,    ///< shines in the color scale * attribute + offset
    principled,  ///< Blender's Principled Volume in the attribute's color
    imported     ///< the material that our add-on made, as dense as kFogOpticalDepth says
  };
  /// What lies beyond is cut away by the add-on's empty. World.
  struct Plane {
    Vec3 point, normal;
  };

  std::string out, attribute;
  CutView view;
  int frame = 1;  ///< of the scene
  Shader shader = Shader::emission;
  double scale = 1, offset = 0;
  /// Blender puts volumes half a voxel too far on every axis. By so many voxels the camera goes along.
  double voxelsTooFar = 0.5;
  std::optional<Plane> plane{};
};

/// Of the slab where `density` is 1, in a Principled Volume: most of its light comes from the first third.
inline constexpr double kFogOpticalDepth = 3;

struct BlenderJob {
  std::filesystem::path folder;  ///< for all that Blender writes
  std::filesystem::path vdb;     ///< alone, or the first of a sequence
  double voxelSize = 0;
  std::map<std::string, std::string>
      grids;  ///< that must be there: names and Blender's words for their types
  std::vector<BlenderCut> cuts;
  /// Blender's own import gets all files of the folder that are numbered as `vdb` is.
  bool sequence = false;
  /// The packed add-on, whose operator imports the sequence instead.
  std::filesystem::path addon{};
};

struct BlenderOutcome {
  int exitCode;  ///< 3: the script found the file not as it should be
  std::string log;
  std::vector<Box> bounds{};  ///< of the volume at the frame of each cut, mesh units; empty where it failed
};

bool haveBlender();
BlenderOutcome runBlender(const BlenderJob& job);

/// Uses the operators of the add-on's panel, on a file with colors and rest and on one with neither.
BlenderOutcome runPanel(const std::filesystem::path& folder, const std::filesystem::path& full,
                        const std::filesystem::path& bare);

/// Packs our add-on as its users do, into a folder.
std::filesystem::path packAddon(const std::filesystem::path& folder);

/// A use of the add-on's import operator: its arguments.
using AddonImport = nlohmann::json;
/// What the operator reports as an error, one text an import; empty where it imported.
std::vector<std::string> addonReports(const std::filesystem::path& folder,
                                      const std::vector<AddonImport>& imports);

}  // namespace polestar::test

#define POLESTAR_REQUIRE_BLENDER() \
  if (!polestar::test::haveBlender()) GTEST_SKIP() << "blender is not installed"
