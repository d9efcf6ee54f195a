#pragma once
// Maps of the boundary surface onto the unit sphere: the map phi of [Xia 2010, sec. 4.1, step 3].

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/star/star_shape.h"

namespace polestar {

enum class SphereMapKind {
  conformal,  ///< angle-preserving, mass-centered: the paper's choice
  fieldLine,  ///< omega: where the field line of the vertex enters the center; needs the chart
  radial,     ///< v / |v| from the center: always one to one on a star shape; the fallback
  balanced    ///< least distortion of the solid's cells; needs the chart (map/balanced.h)
};

inline constexpr std::array kSphereMapKinds{SphereMapKind::conformal, SphereMapKind::fieldLine,
                                            SphereMapKind::radial, SphereMapKind::balanced};

/// "conformal", "field-line", "radial" or "balanced".
const char* toString(SphereMapKind kind);

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

/// Discrete conformal map to the sphere: the minimizer of Dirichlet's energy (cotangents of the intrinsic
/// Delaunay triangulation) from the radial start, found by preconditioned L-BFGS, the Moebius transformation
/// that makes the area-weighted mean of the directions 0, then the rotation that brings it closest
/// (area-weighted least squares) to the radial map. So it depends on the shape alone and turns with it:
/// rotating the input changes it by 1e-14, rounding the input to floats by 1e-7 (measured).
///
/// Triangles that come out flipped (needles, coarse meshes) are turned back by a local flip-free descent of
/// the MIPS energy. When that fails, or the mesh is too coarse for the harmonic map to mean anything (some 40
/// vertices), the whole map is found by such a descent from the radial map; then `repairedVertices` counts
/// all vertices. Should that fail, too (no body is known where it does), the radial map is returned,
/// `fallbackReason` says why, and the context gets a warning: a flip is never shipped.
///
/// Mean dilatation 1 + O(edge length): about 1.01 to 1.04 at 5,000 vertices, 1.003 at 100,000. Cost: one
/// sparse factorization and 6 to 20 solves, a second or two at 100,000 vertices. Same bytes for any number of
/// threads.
/// @throws Error{Errc::cancelled}
/// [Gu et al. 2004; Bobenko, Springborn 2007; Baden, Crane, Kazhdan 2018; Xia 2010, sec. 4.1, step 3]
SphereMap conformalSphereMap(const StarShape& shape, const ConformalOptions& options = {},
                             Context& context = Context::quiet());

/// The map that sends every vertex to the direction `omega` of its field line, with which the ball map's
/// iso-surfaces and radii are orthogonal everywhere and smooth at the center.
///
/// In deep dents the triangles of omega get smaller than the error of the field lines: flipped ones are
/// turned back as for the conformal map, and `repairedVertices` says how many vertices were free to move.
/// Where that fails the conformal map is returned, `fallbackReason` says why, and the context gets a warning.
/// @throws Error{Errc::usage} when there is not one direction a vertex, Error{Errc::cancelled}
SphereMap fieldLineSphereMap(const StarShape& shape, std::span<const Vec3> omega,
                             Context& context = Context::quiet());

/// A map of any origin with its flips and its distortion of angles measured.
SphereMap measuredSphereMap(const StarShape& shape, SphereMapKind kind, std::vector<Vec3> directions);

/// Number of triangles whose images are not positively oriented, by exact predicates.
std::size_t countFlips(std::span<const Vec3> directions, const std::vector<Triangle>& triangles);

/// Rotation Q that minimizes sum_i weight_i |Q from_i - to_i|^2 (Kabsch); proper, also for degenerate input.
Mat3 bestRotation(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const double> weight);

}  // namespace polestar
