#pragma once
// Normals that make facets look like the smooth surface they stand for, but for its creases.

#include <array>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Unit normals at every triangle's corners: the mean over those neighbours around the vertex, weighted by
/// their angles, whose normals differ from the triangle's own by less than `creaseAngle` (radians).
std::vector<std::array<Vec3f, 3>> creasedNormals(const TriMesh& mesh, const std::vector<Vec3>& faceNormals,
                                                 double creaseAngle);

}  // namespace polestar::detail
