#pragma once
// ln r over the directions from a star-shaped solid's center, r the distance to its surface.

#include <vector>

#include "polestar/star/star_shape.h"

namespace polestar::detail {

/// On the sides of a cube, bilinear between nodes that neighbouring sides share: continuous.
class RadiusTable {
 public:
  /// `intervals`: along an edge of the cube.
  explicit RadiusTable(const StarShape& shape, int intervals = 64);

  /// Of a direction of any length but zero, inner units.
  double operator()(const Vec3& direction) const;

 private:
  int intervals_;
  std::vector<float> values_;  ///< by side, row and column
};

}  // namespace polestar::detail
