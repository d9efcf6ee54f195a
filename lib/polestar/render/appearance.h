#pragma once
// What the solid looks like where a pixel sees it. The renderer knows rays and light; colors, and the
// coordinates that stand behind them, come from here.

#include <limits>
#include <memory>
#include <span>

#include "polestar/core/types.h"

namespace polestar {

/// What one pixel sees of one side of the solid: a flat piece of a pixel's size. Mesh units.
struct SurfacePatch {
  Vec3 point = Vec3::Zero();                         ///< on the solid's skin or on a cut
  Vec3 normal = Vec3::Zero();                        ///< unit, outward
  Vec3 first = Vec3::Zero(), second = Vec3::Zero();  ///< unit tangents, perpendicular
  double pixelFirst = 0, pixelSecond = 0;            ///< the pixel's lengths along them
  bool skin = true;
};

/// A place on a patch that a part of the pixel's samples stands for.
struct SurfaceTap {
  std::uint32_t patch = 0;
  double first = 0, second = 0;  ///< from the patch's point, lengths along its tangents
};

struct SurfaceLook {
  Vec3f color = Vec3f::Zero();            ///< scene-linear, Rec. 709 primaries
  float gloss = 0;                        ///< 0 matte, 1 a dielectric coat (4 % at normal incidence)
  float slopeFirst = 0, slopeSecond = 0;  ///< of a relief: height over length along the patch's tangents
  bool known = false;                     ///< is there a color at all? If not, the renderer has one for that
};

/// Immutable; every function may be called from many threads. Output spans have the input's size.
class Appearance {
 public:
  virtual ~Appearance() = default;

  /// The looks of taps, each averaged over the patch's pixel scaled by `share` in length. Batched: a tile's
  /// taps come at once.
  virtual void look(std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps, double share,
                    std::span<SurfaceLook> looks) const = 0;

  /// Ball coordinates and Green's function (1 / mesh units) at points of the solid; NaN where not known.
  /// `skin`: whether the point lies on the skin, where R = 1 and G = 0.
  virtual void coordinates(std::span<const Vec3> points, std::span<const std::uint8_t> skin,
                           std::span<Vec3> ball, std::span<double> green) const = 0;

  /// Mesh units; where cutting planes without an offset go through. NaN: nowhere in particular.
  virtual Vec3 center() const { return Vec3::Constant(std::numeric_limits<double>::quiet_NaN()); }
};

}  // namespace polestar
