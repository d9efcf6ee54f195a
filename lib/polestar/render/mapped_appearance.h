#pragma once
// Looks by the coordinates that a map gives, in the ball or in another domain: a solid texture, and iso-lines
// over it.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "polestar/map/ball_map.h"
#include "polestar/map/volume_map.h"
#include "polestar/render/appearance.h"
#include "polestar/render/iso_lines.h"
#include "polestar/render/lattice.h"
#include "polestar/texture/solid_texture.h"

namespace polestar {

struct MappedLook {
  std::shared_ptr<const SolidTexture> texture;
  bool textureInDomain = false;  ///< its points and footprints are in the domain's frame, not in the ball
  float cutGloss = 0.25f;        ///< a knife leaves a matter surface: share of the texture's gloss
  IsoLines lines;
};

/// The coordinates themselves: panels of a soccer ball times bands of radius, with iso-lines on cuts that are
/// `linePixels` wide.
MappedLook coordinateLook(double linePixels);

/// Unglazed clay all over: what leaves the eye to shapes, shells and lines.
MappedLook plainLook();

/// Cubes of the domain's lattice and lines between them, `linePixels` wide.
MappedLook latticeLook(const Lattice& lattice, double linePixels);

/// Coordinates in a cube or polycube, besides those in the ball.
struct DomainCoordinates {
  Lattice lattice;
  /// Points (mesh units) -> domain frame; outside the solid continued as DomainMap::sample() does it. Of
  /// `skin`, one a point, those that are not 0 are on the solid's surface, or were to be, and get places of
  /// the domain's surface.
  std::function<void(std::span<const Vec3> points, std::span<const std::uint8_t> skin,
                     std::span<Vec3> domain)>
      at;
};

/// The map is asked for about three points a patch. A patch on the skin is looked up half a pixel below it,
/// since the map knows nothing outside; where even that gives NaN (sharp edges), 1e-6 of the way to the
/// center. Its colors are those of R = 1.
/// `green` gives G; a null pointer: G is not known. Both outlive the result. `domain`: for looks that go by
/// it.
/// @throws Error{Errc::usage} for such a look without one.
std::unique_ptr<Appearance> makeMappedAppearance(const VolumeMap& map, const BallMap* green, MappedLook look,
                                                 std::optional<DomainCoordinates> domain = std::nullopt);

}  // namespace polestar
