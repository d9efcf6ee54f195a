#pragma once
// A pinhole camera that looks straight at a plane through the solid, for two renderers to share.

#include "integration/exr.h"

namespace polestar::test {

struct CutView {
  Vec3 position = Vec3::Zero();  ///< world
  Mat3 axes = Mat3::Identity();  ///< columns: right, up and forward in the picture; unit, world
  double fieldOfView = 0;        ///< vertical, radians
  int width = 0, height = 0;     ///< pixels
  double depth = 0;              ///< of the plane, along forward

  /// Along -`axis` (0, 1, 2) at the plane across it through `center`, `across` wide and high; the next axis
  /// is to the right, that after it upwards.
  static CutView ofAxis(int axis, const Vec3& center, double across, int pixels);
  /// The camera of our picture, and the plane that its pixels show where `id` says that they show a cut.
  static CutView ofPicture(const Exr& picture);

  /// The point of the plane in a pixel's middle; rows from above.
  Vec3 pointAt(int x, int y) const;
};

/// The `id` of pixels of the first piece's first cut, as docs of SolidRenderer have it.
inline constexpr std::uint32_t kFirstCut = 2;

}  // namespace polestar::test
