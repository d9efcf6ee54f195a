#pragma once
// Does a given point see the whole surface from inside? Decided by exact signs only.

#include <cstdint>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/frame.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

struct ExactVerdict {
  TriMesh mesh;  ///< in `frame`, with rounded coordinates; the verdict holds for these very numbers too
  Frame frame;   ///< origin at the center, unit the distance to the farthest vertex
  /// Faces whose open half-space does not hold the center, ascending: by the given coordinates or by those of
  /// `mesh`.
  std::vector<std::int32_t> badFaces;
  std::size_t zeroAreaFaces = 0;  ///< among badFaces: collinear corners, on which no center can be inside
  /// How often the surface winds around the center: every direction meets it that many times. 0 when not
  /// computed because of bad faces.
  int windings = 0;

  bool star() const { return badFaces.empty() && windings == 1; }
};

/// @param unit a power of two of the size of the mesh, so that no square of a length overflows or underflows
/// O(n), parallel; about 20 ns a face and thread.
ExactVerdict judgeCenter(const TriMesh& mesh, const Vec3& center, double unit, const Context& context);

}  // namespace polestar::detail
