#pragma once
// What `render` draws: from a file's name to a surface and its looks.

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/session.h"
#include "polestar/map/volume_map.h"
#include "polestar/mesh/tri_mesh.h"
#include "polestar/render/appearance.h"
#include "polestar/render/iso_lines.h"
#include "polestar/texture/procedural.h"

namespace polestar::cli {

struct LookChoices {
  std::string texture;       ///< a name, `lattice`, `coordinates`, or empty: what suits the file
  TextureSettings settings;  ///< of the texture
  /// Of radius, graticule, seams, lattice; nothing: those of the look.
  std::optional<std::vector<std::string>> isoLines;
  double linePixels = 2;

  /// @throws Error{Errc::usage} for names that do not exist and settings that have no texture to shape.
  void validate() const;
};

/// "name=value" @throws Error{Errc::usage}
std::pair<std::string, double> parseSetting(const std::string& text);

/// What of a map is drawn: the solid, the ball of its coordinates, or its domain, where that is another. Ball
/// (with the solid's volume) and domain lie over the solid, so that views and cuts are the same.
enum class Body { solid, ball, domain };

/// Ready to be drawn; the appearance points into what `coordinates` holds.
struct Subject {
  TriMesh surface = {};  ///< mesh units
  std::unique_ptr<Appearance> appearance = nullptr;
  std::string look = {};  ///< "colors of the grid Cd", "texture kiwi" ...
  /// Of the body onto the solid's ball, with images of the surface's vertices; null where colors are drawn.
  std::shared_ptr<const VolumeMap> coordinates = nullptr;
  std::vector<Vec3> directions = {};
};

/// A .pmap, the .vdb beside it, or a .vdb with colors: those are drawn unless a texture or another body than
/// the solid is named, on the skin of the map where that lies beside, else on the grids' own. One subject a
/// body.
/// @throws what loadMap throws; Error{Errc::io} for a .vdb that has neither a map nor colors on a skin;
/// Error{Errc::usage} for a domain, or a look by it, where the map is one onto the ball.
std::vector<Subject> loadSubjects(const std::filesystem::path& path, std::span<const Body> bodies,
                                  const LookChoices& choices, Session& session);

/// Around what a file holds: a .vdb's grids or a map's surface.
Box inputBox(const std::filesystem::path& path);

}  // namespace polestar::cli
