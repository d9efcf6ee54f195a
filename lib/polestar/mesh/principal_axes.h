#pragma once
// Axes that turn with the surface, for whatever has to choose axes.

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// Rotation into the principal axes of the surface's area about the origin: a turned copy of the mesh, or one
/// with other triangles on the same surface, has the same coordinates in them, up to rounding. (Where two
/// moments are equal, as for a cube, the axes are arbitrary.)
///
/// The octrees are laid along them, so that truncation errors turn with the surface: they decide, by a
/// triangle whose error is close to the tolerance, which triangles are split. The search for a polycube's
/// axes begins with them.
Mat3 principalAxes(const TriMesh& mesh);

}  // namespace polestar
