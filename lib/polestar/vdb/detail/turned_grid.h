#pragma once
// A grid turned by a right angle: its voxels are renumbered, and no value but vectors changes.

#include <openvdb/openvdb.h>

#include <array>

#include "polestar/vdb/grid_set.h"

namespace polestar::detail {

/// A right angle about x. Integers on an axis that turns round are complemented, i -> -1 - i, so that nodes
/// of a tree go to whole nodes.
class AxisTurn {
 public:
  explicit AxisTurn(UpAxis up) : negated_{false, up == UpAxis::z, up == UpAxis::y} {}

  int source(int axis) const { return kSource[axis]; }
  bool negated(int axis) const { return negated_[axis]; }

  Vec3 vector(const Vec3& v) const {
    Vec3 result;
    for (int k = 0; k < 3; ++k) result[k] = negated_[k] ? -v[kSource[k]] : v[kSource[k]];
    return result;
  }
  openvdb::Coord index(const openvdb::Coord& at) const {
    openvdb::Coord result;
    for (int k = 0; k < 3; ++k) result[k] = negated_[k] ? -1 - at[kSource[k]] : at[kSource[k]];
    return result;
  }

 private:
  static constexpr std::array<int, 3> kSource{0, 2, 1};
  std::array<bool, 3> negated_;
};

/// Null for types that are no grids of values. @throws Error{Errc::usage} for frustums and staggered vectors.
openvdb::GridBase::Ptr turnedGrid(const openvdb::GridBase& grid, const AxisTurn& turn);

}  // namespace polestar::detail
