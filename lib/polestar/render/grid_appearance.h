#pragma once
// Looks by the colors of a .vdb: what `transfer` made, or anybody's.

#include <memory>

#include "polestar/render/appearance.h"
#include "polestar/render/iso_lines.h"
#include "polestar/vdb/sampled_grids.h"

namespace polestar {

struct GridLook {
  float skinGloss = 0.5f, cutGloss = 0.12f;  ///< see SurfaceLook::gloss; grids say nothing of it
  IsoLines lines;                            ///< where there is a grid `rest`
};

/// The grid of colors: vectors named `Cd` or `color`; nothing where there is none.
const SampledGrid* findColors(const SampledGrids& grids);

/// Colors from findColors(grids), averaged over the pixel; on the skin half a pixel below it. Ball
/// coordinates from the grid `rest` and G from `green` where they are there. The center is that of the
/// metadata. `grids` may go.
/// @throws Error{Errc::usage} when the file has no colors.
std::unique_ptr<Appearance> makeGridAppearance(const SampledGrids& grids, const GridLook& look = {});

}  // namespace polestar
