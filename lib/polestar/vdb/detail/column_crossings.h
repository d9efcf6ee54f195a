#pragma once
// Which side of a closed surface a voxel lies on, by parity: how often the line through the voxel center
// along +z crosses the surface. OpenVDB's own sign comes from a flood that stops at walls a voxel or two
// thick; parity has no such scale, so gaps and blades thinner than a voxel keep their sign.

#include <cstdint>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Crossings of a closed surface with the lines along z through integer points (x, y).
///
/// The crossings of a column are even in number without exact arithmetic: a triangle covers the integers of a
/// half-open interval of each row, and both triangles of an edge compute the interval's end from the same
/// numbers in the same order. A wrong side is possible only for points within rounding (about 1e-13 of the
/// grid) of the surface.
class ColumnCrossings {
 public:
  /// `surface` is in index space (one unit a voxel) and closed. Cost O(triangles + area in voxels).
  ColumnCrossings(const TriMesh& surface, const Context& context);

  /// True when the surface encloses (x, y, z); for embedded surfaces of either orientation.
  bool inside(int x, int y, int z) const;

 private:
  std::size_t column(int x, int y) const {
    return static_cast<std::size_t>(x - xMin_) * yCount_ + static_cast<std::size_t>(y - yMin_);
  }

  int xMin_ = 0, yMin_ = 0;
  std::size_t xCount_ = 0, yCount_ = 0;
  std::vector<std::uint32_t> first_;  // column -> its first crossing; one entry more than columns
  std::vector<double> z_;             // ascending within a column
};

}  // namespace polestar::detail
