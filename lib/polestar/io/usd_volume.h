#pragma once
// A .usda that tells programs with OpenUSD what is in a .vdb, or in a numbered sequence of them: a UsdVol
// Volume with an OpenVDBAsset a grid. Plain text, written without OpenUSD; experimental.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "polestar/vdb/solid_grids.h"

namespace polestar {

struct UsdVolume {
  struct Frame {
    std::optional<int> frame;  ///< nothing: one still
    std::filesystem::path file;
    std::vector<GridInfo> grids;
  };
  std::vector<Frame> frames;  ///< at least one; those with a number ascend
  char upAxis = 'Y';
  double metersPerUnit = 1;
  double framesPerSecond = 24;
};

/// The grids that a .usda can name: all but those of types that OpenVDBAsset has no word for.
std::vector<GridInfo> usdFields(const std::vector<GridInfo>& grids);

/// Writes it atomically; files are named relative to its folder. `comment` goes into the layer's doc.
/// @throws Error{Errc::io} for a frame whose grids are not those of the first, and when it cannot be written;
/// Error{Errc::usage} when there is no grid to name.
void writeUsdVolume(const std::filesystem::path& path, const UsdVolume& volume,
                    const std::string& comment = {});

}  // namespace polestar
