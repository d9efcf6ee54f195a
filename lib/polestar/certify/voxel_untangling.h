#pragma once
// Beside a reentrant edge of a domain the coordinates f shrink as the distance to the power 3/2, and next to
// a convex one they stretch as its root. Samples there are good to a share of a voxel, which is more than
// cells between them are wide in f: some come out inverted although the map is one to one.

#include <functional>
#include <span>
#include <vector>

#include "polestar/certify/voxel_cells.h"
#include "polestar/core/context.h"

namespace polestar {

/// Which of some coordinates lie outside of the domain: 1, else 0.
using IsOutside = std::function<std::vector<char>(std::span<const Vec3>)>;

/// Untangles the deep inverted cells of a block whose samples are coordinates in a polycube: moves the
/// samples around them, as little as it takes, until the tetrahedra at the corners of all cells that they
/// touch are positive (core/detail/untangle_tets.h). First the cells' own corners, then one and two voxels
/// farther; each connected patch by itself. A patch keeps its new places only when fewer of its deep cells
/// are inverted, no more of the others, and no sample has moved by more than two voxels' images. Nothing is
/// moved in the outermost two layers of the block, nor where a neighbour holds no value. O(size^3) and some
/// hundred passes over the patches.
/// @throws Error{Errc::cancelled}
MendedBlock untangleInvertedCells(const VoxelBlock& block, const IsOutside& outside,
                                  const Context& context = Context::quiet());

}  // namespace polestar
