#pragma once
// Is a frame one to one, and what if not? The theorem and its proof are those of a map's table
// (docs/method.md, "One to one"): positive tetrahedra and an embedded boundary make a homeomorphism.

#include <cstddef>
#include <optional>
#include <string>

#include "polestar/morph/morph_path.h"

namespace polestar {

/// Why a surface does not run through itself.
enum class Embedding {
  starShaped,  ///< every triangle is seen from the frame's center, and the surface winds around it once
  noCrossing,  ///< no two triangles meet beyond what they share, and the surface winds around the center once
  none         ///< it does, or does not wind around its center once
};
const char* toString(Embedding embedding);

struct FrameProof {
  CellCounts cells;                 ///< exact, at the frame's nodes
  std::optional<Vec3> firstBad;     ///< middle of the first inverted or flat cell, mesh units
  std::size_t hiddenTriangles = 0;  ///< of the surface, not seen from the center
  std::size_t crossings = 0;        ///< pairs of triangles; looked for where some are hidden
  int winding = 0;                  ///< of the surface around the center
  Embedding embedding = Embedding::none;
  double volume = 0;  ///< of the solid, mesh units cubed

  /// The piecewise linear map from the ball's complex onto the frame's solid is a homeomorphism: exact.
  bool holds() const { return cells.bad() == 0 && embedding != Embedding::none; }
  /// One line: what is wrong, how much of it, where; empty when nothing is.
  std::string fault() const;
};

/// 50 to 100 ns a cell.
FrameProof proveFrame(const MorphComplex& complex, const MorphPose& pose);

/// All times of a straight passage between two shapes, their rotations apart.
struct PassageProof {
  std::size_t cells = 0;
  /// Not shown to be positive at all times: negative somewhere, or undecided after halving time six times.
  std::size_t open = 0;
  bool holds() const { return open == 0; }
};

/// The volume of a tetrahedron whose corners move straight is a cubic in time; positive Bernstein
/// coefficients, beyond a bound of their rounding, show it to be positive throughout. 0.1 us a cell.
/// [Farouki 2012, sec. 3]
PassageProof provePassage(const MorphComplex& complex, std::size_t from, std::size_t to);

}  // namespace polestar
