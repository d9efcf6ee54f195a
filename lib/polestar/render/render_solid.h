#pragma once
// A picture of a parameterized solid: its skin and what a cut lays open, colored by ball coordinates.

#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/io/picture.h"
#include "polestar/map/volume_map.h"
#include "polestar/mesh/tri_mesh.h"
#include "polestar/render/soccer_pattern.h"

namespace polestar {

/// A plane whose outer side is cut away.
struct CutPlane {
  Vec3 normal = Vec3::UnitX();  ///< towards the part that goes; any length but zero
  /// Where the plane lies along its normal: 0 through the map's center, 1 touching the solid's far end
  /// (nothing goes), -1 its near end (all goes); in [-1, 1].
  double offset = 0;
};

enum class Shading {
  studio,  ///< soft key light with shadow, dome with ambient occlusion, gloss on the skin, floor
  flat     ///< the pattern's own colors and a plain background: for diagrams and for tests
};

struct RenderOptions {
  int width = 1280, height = 960;          ///< pixels, 1 to 32768
  int samples = 32;                        ///< a pixel; powers of two are spread best
  Vec3 viewDirection{-0.55, 0.75, -0.36};  ///< the camera looks along it; any length but zero
  Vec3 up = Vec3::UnitZ();  ///< upwards in the picture and away from the floor; not along viewDirection
  double fieldOfView = 26 * std::numbers::pi / 180;  ///< vertical, radians, in (0, 2.5)
  double margin = 0.09;  ///< share of width and height left free on each side, in [0, 0.45]
  /// The region on the outer side of all planes is cut away: one plane takes a part off, two take out a
  /// wedge, three a corner. None: the whole solid.
  std::vector<CutPlane> cuts;
  Shading shading = Shading::studio;
  double lineWidth = 0.006;                          ///< of iso-lines, share of half the box's diagonal
  double creaseAngle = 50 * std::numbers::pi / 180;  ///< edges that turn by more look sharp, radians
  Palette palette;

  void validate() const;  ///< @throws Error{Errc::usage}
};

struct Rendering {
  Picture picture;
  std::size_t solidSamples = 0;     ///< camera samples that saw the solid
  std::size_t unmappedSamples = 0;  ///< of these: where the map gave NaN, drawn in Palette::unmapped
  double seconds = 0;
};

/// Draws the solid inside the closed, outward-oriented `surface` with the pattern of soccer_pattern.h by
/// `map`.
///
/// A sample on the skin is looked up half a pixel below it, since the map knows nothing outside; where even
/// that gives NaN (sharp edges), 1e-7 of the solid's size below. The floor touches the lowest point of what
/// the cut leaves. `map.forward` gets about two points for every pixel besides one for every sample on the
/// solid, in batches of tiles; cost besides: about five rays a sample. The same bytes for any number of
/// threads.
/// @throws Error{Errc::usage} for impossible options or when the cuts leave nothing to see,
/// Error{Errc::cancelled}.
Rendering renderSolid(const TriMesh& surface, const VolumeMap& map, const RenderOptions& options = {},
                      Context& context = Context::quiet());

}  // namespace polestar
