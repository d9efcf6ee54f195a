#pragma once
// Galaxy Maps [Hinderink, Campen 2023], as a program of its own: the executable `galaxy_map` of the authors'
// code, built without its window. Nothing of it is linked.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tet_mesh.h"

namespace polestar::bench {

struct GalaxyMap {
  TetMesh mesh;             ///< the given one, refined where its method needs it
  std::vector<Vec3> image;  ///< one a vertex
};

/// $POLESTAR_GALAXY_MAPS: the executable, or a folder that holds it or has it in `build`. Nothing when the
/// variable is not set or names no such thing.
std::optional<std::filesystem::path> galaxyMapsProgram();

/// Makes the given images one to one, which may turn over tetrahedra; those of the surface stay.
/// @return nothing after `seconds`.
/// @throws std::runtime_error when the program fails or its files cannot be read.
std::optional<GalaxyMap> repairByGalaxyMaps(const std::filesystem::path& program, const TetMesh& mesh,
                                            std::span<const Vec3> image, int seconds);

}  // namespace polestar::bench
