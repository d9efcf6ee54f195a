#include "polestar/sphere/detail/conformal.h"

#include <array>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>

#include "polestar/core/error.h"
#include "polestar/sphere/detail/dirichlet.h"
#include "polestar/sphere/detail/flip_repair.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/moebius.h"
#include "polestar/sphere/detail/sphere_descent.h"
#include "polestar/sphere/detail/sphere_quality.h"

namespace polestar::detail {
namespace {

constexpr const char* kStage = "mapping the surface to the sphere";
/// Share of the sphere's area below which the inscribed polyhedron says little about a map: the minimum may
/// then be degenerate, and rounding of the vertices decides which map is found.
constexpr double kLeastCovered = 0.9;
/// Widths, in edges, of the patches around flipped triangles that may move.
constexpr std::array kRepairRings{2, 5, 12};

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

std::string formatted(const char* format, double a, double b) {
  std::array<char, 160> text;
  std::snprintf(text.data(), text.size(), format, a, b);
  return text.data();
}

/// One conformal map on its way. Steps return an empty string, or the reason why the map cannot be had.
class ConformalSolver {
 public:
  ConformalSolver(const TriMesh& mesh, const ConformalOptions& options, Context& context)
      : mesh_(mesh),
        options_(options),
        context_(context),
        areas_(vertexAreaShares(mesh)),
        radial_(radialMap(mesh)) {}

  SphereMap solve() {
    std::string reason;
    try {
      reason = descend();
      if (reason.empty()) reason = turnFlipsBack();
    } catch (const Error& error) {
      if (error.code() != Errc::notConverged) throw;
      reason = error.what();
    }
    if (reason.empty() && sphereDegree(directions_, mesh_.triangles) != 1)
      reason = "it wraps the sphere more than once";
    SphereMap map;
    if (reason.empty()) {
      map = measured(mesh_, SphereMapKind::conformal, directions_);
      map.repairedVertices = repairedVertices_;
      if (repairedVertices_ > 0 && map.qcMean > radial_.qcMean) {
        reason = formatted(
            "after repair it distorts angles by %.4g on average, the radial map by %.4g: the mesh is too "
            "coarse",
            map.qcMean, radial_.qcMean);
      }
    }
    context_.progress(kStage, 1);
    if (reason.empty()) return map;
    radial_.fallbackReason = "no conformal map: " + reason + "; radial directions are used instead";
    context_.log(LogLevel::warning, radial_.fallbackReason);
    return std::move(radial_);
  }

 private:
  // From the radial map, of degree one and covariant with rotations, down to the harmonic map, which is
  // conformal.
  std::string descend() {
    context_.progress(kStage, 0);
    directions_ = radial_.directions;
    centerByMoebius(directions_, areas_);
    const DirichletEnergy energy(intrinsicDelaunayLaplacian(mesh_), areas_, mesh_.vertices);
    context_.progress(kStage, 0.5);
    const DescentResult descent =
        descendOnSpheres(energy, directions_, {options_.maxIterations, options_.tolerance}, context_);
    context_.progress(kStage, 0.9);
    context_.log(LogLevel::debug, "sphere map: " + std::to_string(descent.iterations) +
                                      formatted(" iterations to energy %.9g, remaining step %.2g",
                                                descent.energy, descent.remaining));
    centerAndAlign(directions_);
    // The energy bounds the area of the polyhedron between the images from above.
    const double covered = descent.energy / (4 * std::numbers::pi);
    if (descent.converged && covered < kLeastCovered) {
      return formatted(
          "the mesh is too coarse (its image has %.3g of the sphere's area, less than %.3g: subdivide)",
          covered, kLeastCovered);
    }
    if (descent.converged) return {};
    return "the descent stopped after " + std::to_string(descent.iterations) +
           formatted(" iterations with directions still moving by %.2g rad (wanted %.2g)", descent.remaining,
                     options_.tolerance);
  }

  void centerAndAlign(std::vector<Vec3>& directions) const {
    centerByMoebius(directions, areas_);
    const Mat3 turn = bestRotation(directions, radial_.directions, areas_);
    for (Vec3& s : directions) s = (turn * s).normalized();
  }

  // Widens the patches until the repair holds, also after centering.
  std::string turnFlipsBack() {
    const std::size_t flips = countFlips(directions_, mesh_.triangles);
    if (flips == 0) return {};
    for (const int rings : kRepairRings) {
      std::vector<Vec3> candidate = directions_;
      const RepairOutcome outcome = repairFlips(mesh_, areas_, rings, candidate, context_);
      if (outcome.crowded) {
        return "it shrinks a part of the surface (deep and narrow, or without inner vertices) below what "
               "doubles resolve";
      }
      if (outcome.repaired) {
        centerAndAlign(candidate);
        if (countFlips(candidate, mesh_.triangles) == 0) {
          directions_ = std::move(candidate);
          repairedVertices_ = outcome.freeVertices;
          context_.log(LogLevel::info, "sphere map: " + std::to_string(flips) +
                                           " flipped triangles were turned back, " +
                                           std::to_string(repairedVertices_) + " vertices were free to move");
          return {};
        }
      }
      if (outcome.freeVertices == mesh_.vertices.size()) break;
    }
    return std::to_string(flips) + " of " + std::to_string(mesh_.triangles.size()) +
           " triangles are flipped and could not be turned back (needles, or too coarse a mesh: remesh)";
  }

  const TriMesh& mesh_;
  const ConformalOptions& options_;
  Context& context_;
  std::vector<double> areas_;
  SphereMap radial_;
  std::vector<Vec3> directions_;
  std::size_t repairedVertices_ = 0;
};

}  // namespace

SphereMap radialMap(const TriMesh& mesh) {
  std::vector<Vec3> directions(mesh.vertices.size());
  for (std::size_t i = 0; i < directions.size(); ++i) directions[i] = mesh.vertices[i].normalized();
  return measured(mesh, SphereMapKind::radial, std::move(directions));
}

SphereMap conformalMap(const TriMesh& mesh, const ConformalOptions& options, Context& context) {
  options.validate();
  return ConformalSolver(mesh, options, context).solve();
}

}  // namespace polestar::detail
