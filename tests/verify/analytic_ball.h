#pragma once
// Balls whose Green's function and field lines are known in closed form, as voxels in memory, and ways to
// spoil them.

#include <functional>

#include "polestar/core/types.h"
#include "verify/voxel_solid.h"

namespace polestar::testing {

/// What a voxel of the unit ball about the origin gets.
struct BallFields {
  std::function<Vec3(const Vec3&)> rest;
  std::function<double(const Vec3&)> green;
  std::function<double(const Vec3&)> surface = [](const Vec3& x) { return x.norm() - 1; };
  Vec3 center = Vec3::Zero();
  double harmonicRadius = 1;
};

/// The exact map of the unit ball with its pole at `center`: Kelvin's image gives G, Stokes' stream function
/// the field lines. Smooth at the pole, so that it has no core.
BallFields exactBall(const Vec3& center);

/// `dim` voxels along the diameter.
verify::VoxelSolid voxelize(const BallFields& fields, int dim);

}  // namespace polestar::testing
