#pragma once
// Are the grids of a .vdb a map of the solid onto the ball by its Green's function? Judged on the stored
// voxels; docs/verify.md says what each check can see and why its limit is where it is. Of a frame of a
// morph, which has no Green's function, whether they are a map onto the ball.

#include "report.h"
#include "voxel_solid.h"

namespace polestar::verify {

/// Checks in the order of causes: a mirrored map has all its cells inverted, but that it is mirrored is what
/// one wants to read. Stops early where the rest would have no meaning. Parallel, about 2 us a voxel.
Report judgeVdb(const VoxelSolid& solid);

}  // namespace polestar::verify
