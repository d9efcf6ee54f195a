#pragma once
// Field lines that leave a sharp edge span sheets across which directions turn faster than any grid holds:
// there samples alias, and cells between them come out inverted although the map is one to one. As everywhere
// in sampling, the cure is a low-pass filter, here in the few places that need it and nowhere else.

#include "polestar/certify/voxel_cells.h"

namespace polestar {

/// Filters `rest` around the deep inverted cells of a block: each sample moves towards the mean of its six
/// neighbours. It keeps its radius in the ball, so that iso-surfaces stay where they are. The weight fades
/// over up to four voxels around those cells. Affine maps stay what they are. Nothing is moved in the
/// outermost two layers of the block, and nothing at all unless no deep inverted cell is left and no more
/// cells are inverted than were: what really folds stays folded. Some hundred passes over the block at most.
MendedBlock filterInvertedCells(const VoxelBlock& block);

}  // namespace polestar
