#pragma once
// How often the images of the voxel cells cover points of the domain.

#include "voxel_solid.h"

namespace polestar::verify {

struct Coverage {
  std::size_t targets = 0;    ///< points of the domain, one in each cube of a lattice
  std::size_t touched = 0;    ///< in the image of some cell
  std::size_t judged = 0;     ///< not in the layer whose cells are incomplete
  std::size_t uncovered = 0;  ///< of the judged: cells over it less mirrored cells is 0
  std::size_t repeated = 0;   ///< of the judged: is neither 0 nor 1
  Vec3 example;               ///< of what is wrong: middle of the judged points that are not covered once
};

/// Every cell of eight inside voxels is cut in six tetrahedra, whose images are looked up at the targets. A
/// target without any counts as in the layer below the surface when it is nearer to the image of a voxel with
/// an incomplete cell than three times that voxel's distance to its neighbours' images: the layer is at most
/// the square root of 3 voxels wide, and at creases the map gets steeper towards the surface. `rest` must be
/// finite and of length at most 2. Parallel; the same counts for any number of threads.
Coverage measureCoverage(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth);

}  // namespace polestar::verify
