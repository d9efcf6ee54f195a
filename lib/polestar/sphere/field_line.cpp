// Field lines' own directions as the map to the sphere.

#include <string>
#include <utility>

#include "polestar/core/covering_number.h"
#include "polestar/sphere/detail/conformal.h"
#include "polestar/sphere/detail/flip_repair.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/sphere_quality.h"

namespace polestar::detail {

SphereMap fieldLineMap(const TriMesh& mesh, std::span<const Vec3> omega, Context& context) {
  std::vector<Vec3> directions(omega.begin(), omega.end());
  const FlipsTurned turned = turnFlipsBack(mesh, vertexAreaShares(mesh), directions, {}, context);
  std::string reason = turned.failure;
  if (reason.empty() && coveringNumber(directions, mesh.triangles) != 1)
    reason = "field lines wrap the sphere more than once";
  if (reason.empty()) {
    SphereMap map = measuredMap(mesh, SphereMapKind::fieldLine, std::move(directions));
    map.repairedVertices = turned.freeVertices;
    return map;
  }
  SphereMap map = conformalMap(mesh, {}, context);
  reason = "no map by field lines: " + reason + "; the " + toString(map.kind) + " map is used instead";
  map.fallbackReason = map.fallbackReason.empty() ? reason : reason + " (" + map.fallbackReason + ")";
  context.log(LogLevel::warning, map.fallbackReason);
  return map;
}

}  // namespace polestar::detail
