#pragma once
// What the argument TEXTURE of `transfer` may be: the name of a procedural texture, a .vdb, or a numbered
// stack of slices; the latter two live in a body of their own, which has a map or gets one.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.h"
#include "polestar/io/slice_stack.h"
#include "polestar/map/ball_map.h"
#include "polestar/texture/procedural.h"
#include "polestar/texture/transfer.h"

namespace polestar::cli {

enum class TextureKind { procedural, grids, slices };

/// By its name: ends in .vdb, has a place for a number, or neither.
TextureKind textureKindOf(const std::string& texture);

/// "seeds=40" -> {"seeds", 40}. @throws Error{Errc::usage}
TextureSettings parseSettings(const std::vector<std::string>& settings);

/// The textures with their parameters, for people; and as JSON.
std::string listTextures();
Json texturesJson();

/// Grids that hold a texture, and the map of the solid that they fill.
struct TextureBody {
  SampledGrids grids;
  BallMap map;
};

/// Reads a .vdb or slices. The body's map is that of `source`; else of the .pmap beside a .vdb of ours; else
/// it is made from the file's own surface, which is said, with the library's defaults.
/// @throws Error{Errc::io}; Error{Errc::usage} when there is no surface and no `source`, or the file belongs
/// to another domain than the ball; Errc::invalidSurface or Errc::notStarShaped for a surface that has no
/// map.
TextureBody loadTextureBody(const std::string& texture, const std::filesystem::path& source,
                            const SliceOptions& slices, Session& session);

}  // namespace polestar::cli
