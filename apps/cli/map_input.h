#pragma once
// Options that shape a map, and where a finished one comes from: shared by map, eval and render.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "cli/session.h"
#include "polestar/map/volume_map.h"
#include "polestar/mesh/tri_mesh.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar::cli {

enum class Core { smooth, paper };

struct MapChoices {
  SphereMapKind boundary = SphereMapKind::conformal;
  Core core = Core::smooth;
  std::string solver = "layer";
  std::optional<Vec3> center;
};

/// Adds --boundary, --core, --solver and --center.
void addMapOptions(CLI::App& app, MapChoices& choices);

/// A .pmap, or the .vdb that lies beside one.
bool isMapName(const std::filesystem::path& path);

/// The .pmap that belongs to a .vdb, or the path itself.
std::filesystem::path mapFileBeside(const std::filesystem::path& path);

}  // namespace polestar::cli
