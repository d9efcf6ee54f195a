#pragma once
// Coordinates of patches: a few points are looked up, what lies between is linear.

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "polestar/render/appearance.h"
#include "polestar/render/iso_lines.h"

namespace polestar::detail {

/// Points of the solid (mesh units) -> coordinates, NaN where there are none.
using CoordinateLookup = std::function<void(std::span<const Vec3> points, std::span<Vec3> coordinates)>;

/// Coordinates at a patch, and how they change along its tangents.
struct LinearCoordinates {
  Vec3 value = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  Vec3 alongFirst = Vec3::Zero(), alongSecond = Vec3::Zero();  ///< per mesh unit

  bool known() const { return value.allFinite(); }
  Vec3 at(const SurfaceTap& tap) const { return value + tap.first * alongFirst + tap.second * alongSecond; }
  /// Of coordinates in the ball: on the skin R = 1, and nowhere more.
  Vec3 inBall(const SurfaceTap& tap, bool skin) const;
};

/// Ball coordinates of patches, of each three points. A patch on the skin is looked up half a pixel below it,
/// since maps know nothing outside; where even that has no coordinates (sharp edges), 4e-6 of the way to
/// `center`, if that is finite.
std::vector<LinearCoordinates> linearBalls(std::span<const SurfacePatch> patches, const Vec3& center,
                                           const CoordinateLookup& lookup);

/// Places in another domain, of three points a patch, by a lookup as DomainCoordinates::at.
using DomainLookup = std::function<void(std::span<const Vec3> points, std::span<const std::uint8_t> skin,
                                        std::span<Vec3> places)>;
std::vector<LinearCoordinates> linearDomain(std::span<const SurfacePatch> patches,
                                            const DomainLookup& lookup);

/// The same for the very points; on the skin R = 1.
void ballCoordinates(std::span<const Vec3> points, std::span<const std::uint8_t> skin, const Vec3& center,
                     const CoordinateLookup& lookup, std::span<Vec3> ball);

/// Draws lines of the ball over looks that are known.
void drawIsoLines(const IsoLines& lines, std::span<const SurfacePatch> patches,
                  std::span<const SurfaceTap> taps, std::span<const LinearCoordinates> balls, double share,
                  std::span<SurfaceLook> looks);

/// Draws IsoLines::lattice.
void drawLatticeLines(const IsoLines& lines, const Lattice& lattice, std::span<const SurfacePatch> patches,
                      std::span<const SurfaceTap> taps, std::span<const LinearCoordinates> domain,
                      double share, std::span<SurfaceLook> looks);

}  // namespace polestar::detail
