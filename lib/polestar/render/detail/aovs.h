#pragma once
// What compositing wants to know of a picture besides its colors: depth, normals, coordinates, ids.

#include "polestar/io/picture.h"
#include "polestar/render/detail/tile.h"
#include "polestar/render/render_solid.h"

namespace polestar::detail {

/// Adds the channels that SolidRenderer promises, empty.
void addAovChannels(Picture& picture);

/// Fills them for a tile.
void fillAovs(const Stage& stage, const PixelBox& tile, Picture& picture);

}  // namespace polestar::detail
