#pragma once
// A second opinion on star-ness that shares nothing with the predicates: rays, counted by Embree.

#include <cstddef>
#include <functional>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

struct RayCount {
  std::size_t count = 0;
  std::size_t failed = 0;  ///< rays whose whole length met the surface not exactly once
};

/// Rays from the origin along direction(0) .. direction(count - 1). A ray through an edge or a vertex that
/// hits several faces around it counts them as one. Single precision: evidence, not proof. About 1 us a ray
/// and thread, besides building the hierarchy.
/// @throws Error{Errc::notConverged} when Embree fails.
RayCount countRayHits(const TriMesh& inner, std::size_t count,
                      const std::function<Vec3(std::size_t)>& direction, const Context& context);

/// One ray through the centroid of every face and `sphereRays` spread evenly over the sphere.
RayCount countRayHits(const TriMesh& inner, int sphereRays, const Context& context);

}  // namespace polestar::detail
