#pragma once
// Moving expansions: multipole to multipole, multipole to local, local to local.
//
// A translation is done in three steps: turn the axes so that it points along z, shift along z (which mixes
// degrees but not orders), turn back. That costs O(p^3) against O(p^4) for the full matrix; many translations
// by the same vector go through together, as many as the registers hold. [White & Head-Gordon 1996;
// rotations: Ivanic & Ruedenberg 1996]

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// The translations between boxes of an octree, up to degree `order`. Expansions are scaled by the side of
/// their box, so one operator serves all levels. Immutable; built in milliseconds.
class Translations {
 public:
  explicit Translations(int order);

  int order() const { return order_; }

  /// One translation: from expansion `source` to expansion `target`, by index into the arrays given to apply.
  struct Pair {
    std::uint32_t source, target;
  };

  /// Boxes of one size, target - source = offset, a vector of whole sides with a component of 2 or 3.
  /// Adds to `local` at the targets.
  void multipoleToLocal(const std::array<int, 3>& offset, std::span<const Pair> pairs,
                        const double* multipole, double* local) const;
  /// From children to parents; `octant` has bit k set when the child lies on the positive side of axis k.
  void multipoleToParent(int octant, std::span<const Pair> pairs, const double* multipole,
                         double* parents) const;
  /// From parents to children.
  void localToChild(int octant, std::span<const Pair> pairs, const double* local, double* children) const;

 private:
  // Rotation by theta about y, block by block: cos and sin terms of each degree do not mix.
  struct Tilt {
    std::vector<double> blocks;
  };
  struct Direction {
    std::vector<double> cosine, sine;  // of m phi
    std::size_t tilt;
  };
  struct Operator {
    Direction direction;
    std::size_t shift;  // index of the shift along z
  };
  Operator makeOperator(const Vec3& vector, std::size_t shift);
  std::size_t addTilt(double cosTheta, double sinTheta);
  template <class Coefficient>
  std::size_t addShift(Coefficient&& coefficient);
  void apply(const Operator& op, std::span<const Pair> pairs, const double* source, double* target) const;

  int order_;
  std::vector<Tilt> tilts_;
  std::vector<std::array<double, 2>> tiltAngles_;  // cosine and sine, to find a tilt again
  std::vector<std::vector<double>> shifts_;  // for each order m: a square matrix over degrees m .. order
  std::vector<std::size_t> blockStart_;      // of degree n in Tilt::blocks
  std::vector<Operator> toLocal_;            // by ((x + 3) 7 + y + 3) 7 + z + 3
  std::array<Operator, 8> toParent_, toChild_;
};

/// The orthogonal matrix that turns the coefficients of degree n: R(Q x) = matrix R(x), for n = 0 .. order.
/// Row-major, in the order of solid_harmonics.h. [Ivanic & Ruedenberg 1996, with the correction of 1998]
std::vector<std::vector<double>> harmonicRotations(int order, const Mat3& rotation);

}  // namespace polestar::detail
