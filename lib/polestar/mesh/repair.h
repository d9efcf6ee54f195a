#pragma once
// What can be mended without guessing at the shape: seams welded, needles and duplicates removed, orientation
// made consistent and outward. Holes are never closed here. Every change is counted.

#include <cstddef>
#include <string>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

struct RepairOptions {
  /// Vertices on open edges closer than this share of the box's diagonal become one; at most 0.01. Equal
  /// vertices are merged anyhow; where the surface is closed already, small detail stays as it is.
  double weldTolerance = 1e-6;
  bool orient = true;  ///< flood-fill a consistent orientation, then outward by signed volume of the whole

  void validate() const;  ///< @throws Error{Errc::usage}
};

struct RepairReport {
  std::size_t verticesBefore = 0, verticesAfter = 0;
  std::size_t trianglesBefore = 0, trianglesAfter = 0;
  std::size_t weldedVertices = 0;       ///< vertices that were merged into another one
  std::size_t unusedVertices = 0;       ///< vertices of no triangle, dropped
  std::size_t degenerateTriangles = 0;  ///< repeated vertices after welding, dropped
  std::size_t zeroAreaTriangles =
      0;  ///< distinct but collinear corners: edge flipped or collapsed, never just dropped
  std::size_t duplicateTriangles = 0;  ///< same three vertices as an earlier triangle, dropped
  std::size_t flippedTriangles = 0;    ///< turned to agree with their neighbours and to face outward
  bool turnedInsideOut = false;  ///< the whole surface faced inward; its triangles do not count as flipped

  bool changedAnything() const;
  std::string summary() const;  ///< "merged 10228 vertices (12276 to 2048); ..." or "nothing to repair"
};

struct RepairedMesh {
  TriMesh mesh;
  RepairReport report;
};

/// Vertices and triangles keep their order; of merged vertices and equal triangles the first stays.
///
/// A zero-area triangle (corners collinear to within the rounding of the coordinates) gives its longest edge
/// to the neighbour, which is cut in two there, or an edge of rounding size is collapsed; either leaves the
/// shape alone. Where topology allows neither, the triangle stays. Closed parts keep their orientation to
/// each other: a cavity stays a cavity, and only the signed volume of the whole is made positive.
///
/// Cost O(n log n). What stays wrong is inspectSurface's to say.
/// @throws Error{Errc::usage} for impossible options, an index out of range, or a NaN or infinite coordinate.
RepairedMesh repairMesh(const TriMesh& mesh, const RepairOptions& options = {});

}  // namespace polestar
