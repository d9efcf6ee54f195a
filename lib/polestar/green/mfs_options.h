#pragma once
// The method of fundamental solutions: h is the potential of point charges outside the solid, and the charges
// are what makes G vanish at points of the surface. It is the paper's own solver. [Xia 2010, sec. 4.1, step
// 2; Fairweather & Karageorghis 1998]
//
// Its matrix is dense: time O(vertices * sources^2), memory O(vertices * sources). The layer is faster and
// more accurate on meshes; what speaks for charges is fidelity to the paper, and solids that are smooth.

#include <vector>

#include "polestar/core/types.h"

namespace polestar {

enum class MfsMode {
  /// The paper's: sources at a constant offset, the equation at the vertices, an SVD.
  paper,
  /// Takes the mesh for samples of a smooth surface. Offsets are bounded by the local reach (the radius of
  /// the largest ball that touches the surface from outside), sources are dense where it is small, and the
  /// largest offset and the cutoff of the SVD are those that do best at vertices held out of a first
  /// equation. There the error falls exponentially with the number of sources. On the flat triangles between
  /// the vertices G is not 0 but what it is on chords of the smooth surface, and the boundary error, which is
  /// that of the mesh, says so.
  smooth
};

struct MfsOptions {
  MfsMode mode = MfsMode::paper;
  /// Sources for every vertex, in (0, 1]. They lie over vertices spread by farthest-point sampling.
  double sourcesPerVertex = 0.6;
  /// Paper: distance of the sources from the surface, along vertex normals, in diagonals of the bounding box.
  double offset = 0.05;
  /// Paper: singular values below this share of the largest count as 0.
  double cutoff = 1e-12;
  /// Smooth: at most this many sources.
  int largestSources = 2000;
  /// Smooth: the offset is at most this share of the local reach, in (0, 1).
  double reachShare = 0.5;
  /// Smooth: this share of the vertices is held out, in (0, 0.5]; at most `largestSources` of them.
  double heldOutShare = 0.2;
  /// Bytes that the dense matrix and its decomposition may take; beyond, the solver refuses at once.
  double memoryLimit = 4e9;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Point charges outside the solid, inner frame: h(x) = sum of charge_i / |x - position_i|.
struct PointSources {
  std::vector<Vec3> positions;
  std::vector<double> charges;
};

/// What the solver did.
struct MfsSummary {
  MfsMode mode = MfsMode::paper;
  std::size_t sources = 0;
  /// Sources that would have come to lie inside the solid, across a dent narrower than the offset: left out,
  /// since h has to be harmonic there.
  std::size_t leftOut = 0;
  double offset = 0;  ///< largest distance of a source from the surface, inner unit
  double cutoff = 0;  ///< of the singular values, relative to the largest
  std::size_t rank = 0;
  double reciprocalCondition = 0;  ///< smallest singular value over the largest
  /// Largest rho |G| at the very points that the equation was posed at: less than it is elsewhere.
  double collocationError = 0;
  /// Smooth: largest rho |G| at the held-out vertices before they joined the equation. They lie on the smooth
  /// surface as the others do: it tells, from above, how far G is from that of the smooth solid. Otherwise 0.
  double heldOutError = 0;
};

}  // namespace polestar
