#pragma once
// Maps of the boundary surface onto the unit sphere: the map phi of [Xia 2010, sec. 4.1, step 3].

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/star/star_shape.h"

namespace polestar {

enum class SphereMapKind {
  conformal,  ///< angle-preserving, mass-centered: the paper's choice
  radial      ///< v / |v| from the center: always one to one on a star shape; the fallback
};

/// Unit vectors, one a vertex; linear (then normalized) on the triangles.
struct SphereMap {
  SphereMapKind kind = SphereMapKind::conformal;
  std::vector<Vec3> directions;
  std::size_t flips = 0;  ///< triangles not positively oriented on the sphere, by exact predicates
  double qcMean = 1;      ///< area-weighted mean of the quasi-conformal dilatation sigma_1 / sigma_2 >= 1
  double qcMax = 1;
  std::size_t repairedVertices =
      0;  ///< vertices that were free to move when flips were turned back; usually none
  /// Not empty when the map is not the one asked for (conformal asked, radial delivered): why, for log and
  /// metadata.
  std::string fallbackReason;
};

/// v / |v| of every vertex. Bijective by the star property; never fails.
SphereMap radialSphereMap(const StarShape& shape);

struct ConformalOptions {
  int maxIterations = 300;   ///< of the Dirichlet descent; 6 to 20 are usual
  double tolerance = 1e-10;  ///< stop when no direction is expected to move by more than this (radians)

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Discrete conformal map to the sphere: Dirichlet energy from the radial start by preconditioned L-BFGS,
/// untangling, a flip-free polish, Moebius centering (area-weighted mean of the directions = 0), then the
/// rotation that brings it closest (area-weighted least squares) to the radial map. So it depends on the
/// shape alone and turns with it.
///
/// When triangles stay flipped the radial map is returned and `fallbackReason` says so: a flip is never
/// shipped. [Gu et al. 2004; Baden, Crane, Kazhdan 2018; Xia 2010, sec. 4.1, step 3]
SphereMap conformalSphereMap(const StarShape& shape, const ConformalOptions& options = {},
                             Context& context = Context::quiet());

/// Number of triangles whose images are not positively oriented, by exact predicates.
std::size_t countFlips(std::span<const Vec3> directions, const std::vector<Triangle>& triangles);

/// Rotation Q that minimizes sum_i weight_i |Q from_i - to_i|^2 (Kabsch); proper, also for degenerate input.
Mat3 bestRotation(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const double> weight);

}  // namespace polestar
