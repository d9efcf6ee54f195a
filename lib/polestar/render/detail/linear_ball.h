#pragma once
// Ball coordinates of patches: a few points are looked up, what lies between is linear.

#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "polestar/render/appearance.h"
#include "polestar/render/iso_lines.h"

namespace polestar::detail {

/// Points of the solid (mesh units) -> ball coordinates, NaN where there are none.
using BallLookup = std::function<void(std::span<const Vec3> points, std::span<Vec3> ball)>;

/// Ball coordinates at a patch, and how they change along its tangents.
struct LinearBall {
  Vec3 ball = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  Vec3 alongFirst = Vec3::Zero(), alongSecond = Vec3::Zero();  ///< per mesh unit

  bool known() const { return ball.allFinite(); }
  /// On the skin R = 1.
  Vec3 at(const SurfaceTap& tap, bool skin) const;
};

/// Looks up three points a patch. A patch on the skin is looked up half a pixel below it, since maps know
/// nothing outside; where even that has no coordinates (sharp edges), 4e-6 of the way to `center`, if that is
/// finite.
std::vector<LinearBall> linearBalls(std::span<const SurfacePatch> patches, const Vec3& center,
                                    const BallLookup& lookup);

/// The same for the very points; on the skin R = 1.
void ballCoordinates(std::span<const Vec3> points, std::span<const std::uint8_t> skin, const Vec3& center,
                     const BallLookup& lookup, std::span<Vec3> ball);

/// Draws the lines over looks that are known.
void drawIsoLines(const IsoLines& lines, std::span<const SurfacePatch> patches,
                  std::span<const SurfaceTap> taps, std::span<const LinearBall> balls, double share,
                  std::span<SurfaceLook> looks);

}  // namespace polestar::detail
