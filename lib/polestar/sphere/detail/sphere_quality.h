#pragma once
// How good a map to the sphere is: orientation (exact), angle distortion.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Indices of the triangles whose images are not positively oriented, ascending; exact.
std::vector<std::int32_t> flippedTriangles(std::span<const Vec3> directions,
                                           const std::vector<Triangle>& triangles);

struct Distortion {
  double mean = 1;  ///< weighted by the area on the surface; triangles of no area do not count
  double max = 1;
};
/// Of the flat triangles between the images of the vertices.
Distortion angleDistortion(const TriMesh& mesh, std::span<const Vec3> directions);

}  // namespace polestar::detail
