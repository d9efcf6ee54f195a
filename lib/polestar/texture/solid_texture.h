#pragma once
// A solid texture: a color for every point of the unit ball, and so of every solid that is mapped onto it.
// Voxels (transfer) and pixels (render) ask the same question: what is seen around this point, averaged over
// this much of the ball?

#include <algorithm>
#include <span>

#include "polestar/core/types.h"

namespace polestar {

/// A place in the ball and how much of it one sample stands for.
struct TexturePoint {
  Vec3 ball = Vec3::Zero();  ///< |ball| <= 1
  /// The parallelepiped around `ball` that the sample covers, edges as columns, ball radii: the Jacobian
  /// times the edges of a voxel. For a pixel on a surface two edges, and 0 for the third; 0 for a point.
  Mat3 footprint = Mat3::Zero();

  /// How far a quantity with this gradient (per ball radius) varies over the sample: the width to filter its
  /// edges by. The root of the sum of squares over the edges, so it does not depend on how they are turned.
  double spread(const Vec3& gradient) const { return (footprint.transpose() * gradient).norm(); }
};

struct TextureSample {
  Vec3f color = Vec3f::Zero();  ///< scene-linear, Rec. 709 primaries
  float gloss = 0;              ///< of the skin: 0 matte, 1 a dielectric coat (4 % at normal incidence)
  /// Of the relief of the skin: d height / d ball, both in ball radii. Pictures shade by it.
  Vec3 heightGradient = Vec3::Zero();
};

/// Immutable; every function may be called from many threads. Output spans have the input's size.
class SolidTexture {
 public:
  virtual ~SolidTexture() = default;

  /// Finite for every point with |ball| <= 1 (1e-6 more is forgiven) and every footprint; details finer than
  /// the footprint are averaged, in linear light.
  virtual void sample(std::span<const TexturePoint> points, std::span<TextureSample> samples) const = 0;

  /// Does the material have a grain?
  virtual bool hasFiber() const { return false; }
  /// Along the grain, ball coordinates, of any length; 0 where there is no direction. A vector of the ball: a
  /// solid's grain is what the inverse Jacobian of its map makes of it.
  virtual void fiber(std::span<const Vec3> ball, std::span<Vec3> direction) const {
    (void)ball;
    std::fill(direction.begin(), direction.end(), Vec3::Zero());
  }
};

}  // namespace polestar
