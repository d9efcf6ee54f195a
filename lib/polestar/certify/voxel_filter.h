#pragma once
// Field lines that leave a sharp edge span sheets across which directions turn faster than any grid holds:
// there samples alias, and cells between them come out inverted although the map is one to one. As everywhere
// in sampling, the cure is a low-pass filter, here in the few places that need it and nowhere else.

#include <array>
#include <cstddef>
#include <vector>

#include "polestar/certify/voxel_cells.h"

namespace polestar {

/// Lowest corners, by their place in the block, of the cells that judgeCells() counts as invertedDeep.
std::vector<std::array<int, 3>> deepInvertedCells(const VoxelBlock& block);

struct FilteredBlock {
  std::vector<Vec3f> rest;         ///< of the block, in its order
  std::vector<std::size_t> moved;  ///< samples that changed, ascending
  double largestMove = 0;          ///< in the units of `rest`
};

/// Filters `rest` around the deep inverted cells of a block: each sample moves towards the mean of its six
/// neighbours. In the ball it keeps its radius, so that iso-surfaces stay where they are; in other domains
/// (`inBall` false) nothing is special about radii. The weight fades over up to four voxels around those
/// cells. Affine maps stay what they are. Nothing is moved in the outermost two layers of the block, and
/// nothing at all unless no deep inverted cell is left (in other domains than the ball: fewer are) and no
/// more cells are inverted than were: what really folds stays folded. Some hundred passes over the block at
/// most.
FilteredBlock filterInvertedCells(const VoxelBlock& block, bool inBall = true);

}  // namespace polestar
