#pragma once
// How a map of a solid onto the ball distorts: seen from the solid, where every piece counts by its volume,
// from the ball, where hexahedra are laid out evenly, and on tetrahedra that it moves.

#include <span>
#include <vector>

#include "polestar/map/volume_map.h"
#include "polestar/star/star_shape.h"
#include "tet_mesh.h"

namespace polestar::bench {

/// One at a random place of every box of a lattice of `count` boxes of the solid's volume; also outside it.
std::vector<Vec3> latticePoints(const StarShape& shape, std::size_t count);

struct Spread {
  double mean = 0, p99 = 0;
};

/// At points spread evenly over the solid.
struct SolidDistortion {
  std::size_t points = 0, folded = 0;  ///< folded: det J <= 0 to rounding, not counted below
  Spread mips;                         ///< |J|^2 / (3 det J^(2/3)) >= 1
  double logVolumeDeviation = 0;       ///< standard deviation of ln det J
  /// Degrees between the images of radii of the ball and the normals of the images of its concentric spheres.
  Spread skew;
};
/// Of `points` those that the map knows; skew where |f| > `core`.
SolidDistortion measureSolid(const VolumeMap& map, std::span<const Vec3> points, double core);

/// Scaled Jacobians of hexahedra that are even in the ball: `cells`^2 a side of a cubed sphere (equal
/// angles), `cells` layers from 0.1 to the surface; the least of a hexahedron's eight corners.
struct HexDistortion {
  std::size_t cells = 0, bad = 0;  ///< bad: not positive, or a corner without a preimage
  double min = 0, p1 = 0, mean = 0;
};
HexDistortion measureHexahedra(const VolumeMap& map, int cells);

/// Of a map that is linear in tetrahedra.
struct TetDistortion {
  std::size_t tetrahedra = 0;
  /// Turned over or flat once the images of the vertices are rounded to float (exact): those with a vertex
  /// inside, and those with all four on the surface, whose sign the map of the surface decides.
  std::size_t inverted = 0, invertedOnSurface = 0;
  std::size_t onSurface = 0;  ///< tetrahedra of that kind
  /// Every tetrahedron counts by its volume in the solid; not those that are turned over or flat to the
  /// rounding of doubles, before or after.
  Spread mipsBySolid;
  Spread mipsByBall;              ///< the same by that of its image
  double logVolumeDeviation = 0;  ///< by volumes in the solid
};
TetDistortion measureTetrahedra(const TetMesh& mesh, std::span<const Vec3> image);

}  // namespace polestar::bench
