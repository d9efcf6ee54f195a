#pragma once
// The one place that knows OpenVDB.

#include <filesystem>

#include "voxel_solid.h"

namespace polestar::verify {

/// Reads `surface`, `rest`, `green` and their metadata; voxels with surface < 0 are inside. A frame of a
/// morph (metadata polestar:weights) has no `green`. Other grids have to share the transform and are else
/// left alone.
/// @throws Unreadable for what is missing, damaged, no map onto the ball, or too large to judge.
VoxelSolid readVdb(const std::filesystem::path& path);

}  // namespace polestar::verify
