#pragma once
// From boundary parameters back to the surface: where on a solid's surface is the point whose image on the
// sphere is this direction? Exact where the map of the solid, which interpolates G, is only near.

#include <memory>
#include <span>

#include "polestar/map/ball_map.h"

namespace polestar {

/// phi^-1 of a ball map. Cheap to copy; every function may be called from many threads.
class SurfacePoints {
 public:
  explicit SurfacePoints(const BallMap& map);

  /// Directions of any length but zero -> points of the surface's triangles, mesh units. NaN for a direction
  /// that is no number or that flipped triangles of phi leave uncovered. O(log n) each.
  void at(std::span<const Vec3> directions, std::span<Vec3> solid) const;

  /// BallMap::inverse, continued outside the ball by c + |y| (q - c), q = at(y). Next to the sphere, where
  /// the map, which interpolates, may have no answer, that stands for it.
  void continuedInverse(std::span<const Vec3> ball, std::span<Vec3> solid) const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

}  // namespace polestar
