#pragma once
// What moving the vertices of a mesh did to its tetrahedra: which turned over, by exact predicates, and how
// their shapes changed. [Xia 2010, sec. 4.1, step 4; docs/method.md sec. 6]

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar {

/// Corners of tetrahedra, positive where the fourth sees the first three counter-clockwise: (0,0,0), (1,0,0),
/// (0,1,0), (0,0,1) is, as in VTK, Medit and gmsh.
using Tetrahedron = std::array<std::int32_t, 4>;

struct TetSigns {
  std::size_t positive = 0, negative = 0, flat = 0;
  std::size_t all() const { return positive + negative + flat; }
};

/// Mean ratios: 12 (3 V)^(2/3) / (sum of squared edges), 1 for a regular tetrahedron, 0 for a flat one,
/// independent of size. [Liu and Joe 1994]
struct TetQuality {
  double least = 0, onePercent = 0, mean = 0;  ///< onePercent: 1 % of the tetrahedra lie at or below it
};

struct TetReport {
  std::size_t tetrahedra = 0;
  /// With all four vertices on the boundary: the sign of such a one is decided by what happens to the
  /// boundary alone, however good the map is inside.
  std::size_t onBoundary = 0;
  TetSigns before, after;

  /// Changed sides: positive before and negative after, or the reverse (a file may count corners the other
  /// way round throughout). Flattened: had a volume and has none.
  std::size_t turned = 0, flattened = 0;
  std::size_t turnedOnBoundary = 0, flattenedOnBoundary = 0;  ///< of those, the ones of `onBoundary`
  std::vector<std::size_t> bad;  ///< positions of all that turned over or went flat, ascending

  TetQuality qualityBefore;
  TetQuality qualityAfter;  ///< negative for those that turned

  bool good() const { return turned == 0 && flattened == 0; }
};

/// Which vertices lie on faces of one tetrahedron only.
std::vector<char> boundaryVertices(std::span<const Tetrahedron> tetrahedra, std::size_t vertexCount);

/// Compares the mesh before and after its vertices moved. Indices must be valid, coordinates finite. Cost
/// O(n log n), parallel.
TetReport compareTetrahedra(std::span<const Tetrahedron> tetrahedra, std::span<const Vec3> before,
                            std::span<const Vec3> after);

/// Mean ratio of |V|, without a sign.
double meanRatio(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

}  // namespace polestar
