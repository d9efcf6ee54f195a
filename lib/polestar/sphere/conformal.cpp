#include "polestar/sphere/detail/conformal.h"

#include <algorithm>
#include <string>
#include <utility>

#include "polestar/core/error.h"
#include "polestar/sphere/detail/dirichlet.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/moebius.h"
#include "polestar/sphere/detail/sphere_descent.h"
#include "polestar/sphere/detail/sphere_quality.h"

namespace polestar::detail {
namespace {

SphereMap measured(const TriMesh& mesh, SphereMapKind kind, std::vector<Vec3> directions) {
  SphereMap map;
  map.kind = kind;
  map.flips = countFlips(directions, mesh.triangles);
  const Distortion distortion = angleDistortion(mesh, directions);
  map.qcMean = distortion.mean;
  map.qcMax = distortion.max;
  map.directions = std::move(directions);
  return map;
}

SphereMap fallback(const TriMesh& mesh, std::string reason, Context& context) {
  SphereMap map = radialMap(mesh);
  map.fallbackReason = std::move(reason);
  context.log(LogLevel::warning, "conformal sphere map: " + map.fallbackReason);
  return map;
}

}  // namespace

SphereMap radialMap(const TriMesh& mesh) {
  std::vector<Vec3> directions(mesh.vertices.size());
  for (std::size_t i = 0; i < directions.size(); ++i) directions[i] = mesh.vertices[i].normalized();
  return measured(mesh, SphereMapKind::radial, std::move(directions));
}

SphereMap conformalMap(const TriMesh& mesh, const ConformalOptions& options, Context& context) {
  options.validate();
  context.progress("mapping the surface to the sphere", 0);
  const std::vector<double> areas = vertexAreaShares(mesh);
  std::vector<Vec3> radial(mesh.vertices.size());
  for (std::size_t i = 0; i < radial.size(); ++i) radial[i] = mesh.vertices[i].normalized();

  // From the radial map, of degree one and covariant with rotations, down to the harmonic map, which is
  // conformal.
  std::vector<Vec3> directions = radial;
  centerByMoebius(directions, areas);
  try {
    const DirichletEnergy energy(intrinsicDelaunayLaplacian(mesh), areas);
    const DescentResult descent =
        descendOnSpheres(energy, directions, {options.maxIterations, options.tolerance}, context);
    context.log(LogLevel::debug, "conformal sphere map: " + std::to_string(descent.iterations) +
                                     " iterations, energy " + std::to_string(descent.energy) +
                                     ", remaining step " + std::to_string(descent.remaining));
    if (!descent.converged) {
      return fallback(mesh,
                      "the conformal map did not converge in " + std::to_string(descent.iterations) +
                          " iterations; radial directions are used instead",
                      context);
    }
  } catch (const Error& error) {
    if (error.code() != Errc::notConverged) throw;
    return fallback(mesh, std::string(error.what()) + "; radial directions are used instead", context);
  }
  context.progress("mapping the surface to the sphere", 0.8);

  centerByMoebius(directions, areas);
  const Mat3 turn = bestRotation(directions, radial, areas);
  for (Vec3& s : directions) s = (turn * s).normalized();

  const auto flipped = flippedTriangles(directions, mesh.triangles);
  if (!flipped.empty() || sphereDegree(directions, mesh.triangles) != 1) {
    return fallback(mesh,
                    "the conformal map turns " + std::to_string(flipped.size()) +
                        " triangles over (needles or a coarse mesh); radial directions are used instead",
                    context);
  }
  context.progress("mapping the surface to the sphere", 1);
  return measured(mesh, SphereMapKind::conformal, std::move(directions));
}

}  // namespace polestar::detail
