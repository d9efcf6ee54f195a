#pragma once
// Looks by ball coordinates, which a map gives: a solid texture, or the pattern that shows the coordinates
// themselves; iso-lines over either.

#include <memory>

#include "polestar/map/ball_map.h"
#include "polestar/map/volume_map.h"
#include "polestar/render/appearance.h"
#include "polestar/render/iso_lines.h"
#include "polestar/render/soccer_pattern.h"
#include "polestar/texture/solid_texture.h"

namespace polestar {

struct MappedLook {
  /// Nothing: the coordinates as the pattern of soccer_pattern.h.
  std::shared_ptr<const SolidTexture> texture;
  Palette palette;        ///< of that pattern
  double seamWidth = 0;   ///< of that pattern, mesh units
  float cutGloss = 0.15f; ///< a knife leaves a matter surface: of the gloss of that pattern or texture
  IsoLines lines;
};

/// The map is asked for about three points a patch. A patch on the skin is looked up half a pixel below it,
/// since the map knows nothing outside; where even that gives NaN (sharp edges), 1e-6 of the way to the
/// center. Its colors are those of R = 1.
/// `green` gives G; a null pointer: G is not known. Both outlive the result.
std::unique_ptr<Appearance> makeMappedAppearance(const VolumeMap& map, const BallMap* green, MappedLook look);

}  // namespace polestar
