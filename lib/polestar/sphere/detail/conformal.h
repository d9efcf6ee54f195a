#pragma once
// The sphere maps without the proof: what conformalSphereMap and its sisters do, on any mesh that is
// star-shaped about the origin.

#include "polestar/sphere/sphere_map.h"

namespace polestar::detail {

/// With flips and quality.
SphereMap measuredMap(const TriMesh& mesh, SphereMapKind kind, std::vector<Vec3> directions);

/// Directions of the vertices from the origin, with quality.
SphereMap radialMap(const TriMesh& mesh);

/// As conformalSphereMap. The radial map of `mesh` must have no flips.
SphereMap conformalMap(const TriMesh& mesh, const ConformalOptions& options, Context& context);

/// As fieldLineSphereMap.
SphereMap fieldLineMap(const TriMesh& mesh, std::span<const Vec3> omega, Context& context);

}  // namespace polestar::detail
