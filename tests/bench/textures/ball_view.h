#pragma once
// The unit ball, cut by half-spaces and seen by a parallel camera: the plainest picture of a solid texture.

#include <vector>

#include "polestar/core/types.h"
#include "polestar/io/picture.h"
#include "polestar/texture/solid_texture.h"

namespace polestar::bench {

struct BallView {
  Vec3 towardsCamera = Vec3::UnitZ(), up = Vec3::UnitY();
  /// What lies on the positive side of every one of these planes through `corner` is cut away; none: the
  /// whole ball.
  std::vector<Vec3> cuts;
  Vec3 corner = Vec3::Zero();
  double width = 2.2;  ///< of the picture, ball radii
};

struct Square {
  int x, y, size;  ///< pixels
};

/// Draws into `square` of `picture` with `side` x `side` samples a pixel, each with the footprint of its
/// share of the pixel.
void drawBall(const SolidTexture& texture, const BallView& view, int side, const Square& square,
              Picture& picture);

}  // namespace polestar::bench
