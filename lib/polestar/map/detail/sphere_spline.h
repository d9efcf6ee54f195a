#pragma once
// Fields of angular velocity on the sphere that bend as little as they can, between points that they move.

#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// omega(x) = c + sum_j R(x . p_j) alpha_j with the reproducing kernel R of integral |laplacian f|^2, in
/// closed form [Wahba 1981, eq. (3.3) with m = 2]: the field of least bending that moves every point p_j by
/// the tangential velocity asked of it. Only the velocity omega x p_j is asked for, so that the spin about
/// the points is free, and a turn of the whole sphere costs (nearly) nothing. R behaves like r^2 ln r: the
/// field has continuous first derivatives, at the points, too.
class SphereSpline {
 public:
  struct Demand {
    Vec3 point;     ///< unit vector
    Vec3 velocity;  ///< as an angular velocity, at right angles to `point`
    double weight;  ///< positive, about 1
  };
  /// Demands that lie closer together than about `resolution` (radians) share their motion: each may be
  /// missed, at a price of weight / resolution^2. O(n^3).
  SphereSpline(std::span<const Demand> demands, double resolution);

  Vec3 operator()(const Vec3& x) const;

 private:
  std::vector<Vec3> points_, alpha_;
};

}  // namespace polestar::detail
