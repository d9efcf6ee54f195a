#pragma once
// Looks by ball coordinates, which a map gives: a solid texture, and iso-lines over it.

#include <memory>

#include "polestar/map/ball_map.h"
#include "polestar/map/volume_map.h"
#include "polestar/render/appearance.h"
#include "polestar/render/iso_lines.h"
#include "polestar/texture/solid_texture.h"

namespace polestar {

struct MappedLook {
  std::shared_ptr<const SolidTexture> texture;
  float cutGloss = 0.25f;  ///< a knife leaves a matter surface: share of the texture's gloss
  IsoLines lines;
};

/// The coordinates themselves: panels of a soccer ball times bands of radius, with iso-lines on cuts that are
/// `linePixels` wide.
MappedLook coordinateLook(double linePixels);

/// Unglazed clay all over: what leaves the eye to shapes, shells and lines.
MappedLook plainLook();

/// The map is asked for about three points a patch. A patch on the skin is looked up half a pixel below it,
/// since the map knows nothing outside; where even that gives NaN (sharp edges), 1e-6 of the way to the
/// center. Its colors are those of R = 1.
/// `green` gives G; a null pointer: G is not known. Both outlive the result.
std::unique_ptr<Appearance> makeMappedAppearance(const VolumeMap& map, const BallMap* green, MappedLook look);

}  // namespace polestar
