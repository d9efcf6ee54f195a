#pragma once
// The conformal map without the proof: what conformalSphereMap does, on any mesh that is star-shaped about
// the origin.

#include "polestar/sphere/sphere_map.h"

namespace polestar::detail {

/// Directions of the vertices from the origin, with quality.
SphereMap radialMap(const TriMesh& mesh);

/// As conformalSphereMap. The radial map of `mesh` must have no flips.
SphereMap conformalMap(const TriMesh& mesh, const ConformalOptions& options, Context& context);

}  // namespace polestar::detail
