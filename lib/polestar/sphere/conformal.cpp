#include "polestar/sphere/detail/conformal.h"

#include <array>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>

#include "polestar/core/covering_number.h"
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
    std::string reason = harmonic();
    if (!reason.empty()) {
      context_.log(LogLevel::info, "sphere map: " + reason + "; descending from the radial map instead");
      reason = flipFree();
    }
    context_.progress(kStage, 1);
    if (reason.empty()) {
      SphereMap map = measuredMap(mesh_, SphereMapKind::conformal, std::move(directions_));
      map.repairedVertices = repairedVertices_;
      return map;
    }
    radial_.fallbackReason = "no conformal map: " + reason + "; radial directions are used instead";
    context_.log(LogLevel::warning, radial_.fallbackReason);
    return std::move(radial_);
  }

 private:
  // The usual way: the harmonic map, and what it flips turned back.
  std::string harmonic() {
    try {
      std::string reason = descend();
      if (reason.empty()) {
        const FlipsTurned turned = turnFlipsBack(
            mesh_, areas_, directions_, [this](std::vector<Vec3>& s) { centerAndAlign(s); }, context_);
        reason = turned.failure;
        repairedVertices_ = turned.freeVertices;
      }
      if (reason.empty() && coveringNumber(directions_, mesh_.triangles) != 1)
        reason = "it wraps the sphere more than once";
      if (reason.empty() && repairedVertices_ > 0) reason = objectionToDistortion();
      return reason;
    } catch (const Error& error) {
      if (error.code() != Errc::notConverged) throw;
      return error.what();
    }
  }

  // The way that never meets a flip, for coarse meshes and needles.
  std::string flipFree() {
    directions_ = radial_.directions;
    repairedVertices_ = directions_.size();
    try {
      descendFlipFree(mesh_, areas_, directions_, context_);
    } catch (const Error& error) {
      if (error.code() != Errc::notConverged) throw;
      return error.what();
    }
    // Already centered to a few more digits; where triangles are needles these may cost flips.
    std::vector<Vec3> centered = directions_;
    centerAndAlign(centered);
    if (countFlips(centered, mesh_.triangles) == 0) {
      directions_ = std::move(centered);
    } else {
      align(directions_);
      if (countFlips(directions_, mesh_.triangles) > 0) return "turning it would flip needles";
    }
    return objectionToDistortion();
  }

  std::string objectionToDistortion() const {
    const double mean = angleDistortion(mesh_, directions_).mean;
    if (mean <= radial_.qcMean * (1 + 1e-9)) return {};
    return formatted("it would distort angles by %.4g on average, the radial map does by %.4g", mean,
                     radial_.qcMean);
  }

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
    align(directions);
  }

  void align(std::vector<Vec3>& directions) const {
    const Mat3 turn = bestRotation(directions, radial_.directions, areas_);
    for (Vec3& s : directions) s = (turn * s).normalized();
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

SphereMap measuredMap(const TriMesh& mesh, SphereMapKind kind, std::vector<Vec3> directions) {
  SphereMap map;
  map.kind = kind;
  map.flips = countFlips(directions, mesh.triangles);
  const Distortion distortion = angleDistortion(mesh, directions);
  map.qcMean = distortion.mean;
  map.qcMax = distortion.max;
  map.directions = std::move(directions);
  return map;
}

SphereMap radialMap(const TriMesh& mesh) {
  std::vector<Vec3> directions(mesh.vertices.size());
  for (std::size_t i = 0; i < directions.size(); ++i) directions[i] = mesh.vertices[i].normalized();
  return measuredMap(mesh, SphereMapKind::radial, std::move(directions));
}

SphereMap conformalMap(const TriMesh& mesh, const ConformalOptions& options, Context& context) {
  options.validate();
  return ConformalSolver(mesh, options, context).solve();
}

}  // namespace polestar::detail
