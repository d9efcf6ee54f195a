#pragma once
// All tiles of a picture, or of a part of it, in parallel.

#include <functional>

#include "polestar/core/context.h"
#include "polestar/io/picture.h"
#include "polestar/render/detail/tile.h"
#include "polestar/render/render_solid.h"

namespace polestar::detail {

/// The picture of `crop`, or of everything; black and transparent, with its place in the full picture.
Picture emptyPicture(const RenderOptions& options);

/// Calls `render` for every tile that has pixels of the picture, whole tiles of a grid that begins at the
/// full picture's corner: what a tile computes together does not depend on the crop. `number` counts them
/// row by row. Progress goes under `stage`.
/// @throws Error{Errc::cancelled}
void forEachTile(const RenderOptions& options, const Picture& picture, std::string_view stage,
                 Context& context,
                 const std::function<void(std::size_t number, const PixelBox& tile)>& render);
/// How many that are.
std::size_t tileCount(const Picture& picture);

/// Copies a tile's pixels, row by row, into the picture that has a part of them.
void copyTile(const PixelBox& tile, const std::vector<Eigen::Vector4f>& pixels, Picture& picture);

}  // namespace polestar::detail
