#pragma once
// What `render` draws: from a file's name to a surface and its looks.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.h"
#include "polestar/map/ball_map.h"
#include "polestar/mesh/tri_mesh.h"
#include "polestar/render/appearance.h"
#include "polestar/render/iso_lines.h"
#include "polestar/texture/procedural.h"

namespace polestar::cli {

struct LookChoices {
  std::string texture;       ///< a name, `coordinates`, or empty: what suits the file
  TextureSettings settings;  ///< of the texture
  /// Of radius, graticule, seams; nothing: those of `coordinates`, none with other looks.
  std::optional<std::vector<std::string>> isoLines;
  double linePixels = 2;

  /// @throws Error{Errc::usage} for names that do not exist and settings that have no texture to shape.
  void validate() const;
};

/// "name=value" @throws Error{Errc::usage}
std::pair<std::string, double> parseSetting(const std::string& text);

/// Ready to be drawn; the appearance points into the map.
struct Subject {
  std::unique_ptr<const BallMap> map;
  TriMesh surface;
  std::unique_ptr<Appearance> appearance;
  std::string look;  ///< "colors of the grid Cd", "texture kiwi" ...
};

/// A .pmap, the .vdb beside it, or a .vdb with colors: those are drawn unless a texture is named, on the skin
/// of the map where that lies beside, else on the grids' own.
/// @throws what loadMap throws; Error{Errc::io} for a .vdb that has neither a map nor colors on a skin.
Subject loadSubject(const std::filesystem::path& path, const LookChoices& choices, Session& session);

/// Around what a file holds: a .vdb's grids or a map's surface.
Box inputBox(const std::filesystem::path& path);

}  // namespace polestar::cli
