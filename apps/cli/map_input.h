#pragma once
// Options that shape a map, and where a finished one comes from: shared by map, eval and render.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "cli/session.h"
#include "polestar/pipeline.h"

namespace polestar::cli {

struct MapChoices {
  std::optional<SphereMapKind> boundary;  ///< nothing: conformal
  std::optional<RadiusKind> radius;       ///< nothing: what suits the boundary
  std::optional<double> balanceVolume;    ///< nothing: the library's default
  CoreMode core = CoreMode::smooth;
  GreenSolver solver = GreenSolver::layer;
  MfsMode mfs = MfsMode::paper;
  double tolerance = 1e-3;  ///< of rho |G| on the surface
  bool prove = false;       ///< enclose that error
  std::optional<Vec3> center;
  DeviceChoice device;
};

/// Adds --boundary, --radius, --balance-volume, --core, --solver, --mfs, --tolerance, --prove, --device and
/// --center.
void addMapOptions(CLI::App& app, MapChoices& choices);

/// What the library makes of them. @throws Error{Errc::usage} for a weight of volumes where nothing is
/// balanced.
MapOptions toMapOptions(const MapChoices& choices);

/// The weight of volumes that a map made by `choices` has; nothing where neither boundary nor radius is
/// balanced.
std::optional<double> balanceVolumeOf(const BallMap& map, const MapChoices& choices);

/// A .pmap, or the .vdb that lies beside one.
bool isMapName(const std::filesystem::path& path);

/// The .pmap that belongs to a .vdb, or the path itself.
std::filesystem::path mapFileBeside(const std::filesystem::path& path);

/// A .pmap, or the one beside a .vdb: then the grids must carry its hash.
/// @throws Error{Errc::io}
MapFile loadMapFile(const std::filesystem::path& path, Session& session);
/// Its map onto the ball, whatever its domain is.
BallMap loadMap(const std::filesystem::path& path, Session& session);

/// The map of a solid that only grids tell of, made from the surface of their level set or fog with the
/// library's defaults; said in the log. `whose`: "texture", "target" or "shape", for messages and the timing.
/// @throws what solidSurface throws; Errc::invalidSurface or Errc::notStarShaped for a surface without a map.
BallMap mapOwnSurface(const SampledGrids& grids, const std::string& name, const std::string& whose,
                      Session& session);

/// loadMap(), and mapOwnSurface() of a .vdb that has no .pmap beside it.
BallMap loadOrMakeMap(const std::filesystem::path& path, const std::string& whose, Session& session);

/// loadOrMakeMap(), and a mesh is mapped with the library's defaults, too.
/// @throws what they throw; Error{Errc::io} for a file that is no mesh.
BallMap loadOrMapSolid(const std::filesystem::path& path, const std::string& whose, Session& session);

/// From a mesh to its map in memory: inspects it as `check` does and fills what `map` says of the stages.
/// @throws Error{Errc::usage} for a weight of volumes where nothing is balanced; what inspectSolid and the
/// library's stages throw.
BallMap makeMap(const std::filesystem::path& mesh, const MapChoices& choices, Session& session);

}  // namespace polestar::cli
