#pragma once
// What can be mended without guessing at the shape: seams welded, needles and duplicates removed, orientation made
// consistent and outward. Holes are never closed here. Every change is counted.

#include <cstddef>
#include <string>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

struct RepairOptions {
  double weldTolerance = 1e-6;  ///< vertices closer than this share of the box's diagonal become one; 0: exact equals only
  bool orient = true;           ///< flood-fill a consistent orientation, then outward by signed volume

  void validate() const;  ///< @throws Error{Errc::usage}
};

struct RepairReport {
  std::size_t weldedVertices = 0;      ///< vertices that were merged into another one
  std::size_t unusedVertices = 0;      ///< vertices of no triangle, dropped
  std::size_t degenerateTriangles = 0; ///< repeated vertices after welding, dropped
  std::size_t zeroAreaTriangles = 0;   ///< distinct but collinear corners: edge flipped or collapsed, never just dropped
  std::size_t duplicateTriangles = 0;  ///< same three vertices as an earlier triangle, dropped
  std::size_t flippedTriangles = 0;    ///< turned to agree with their neighbours
  bool turnedInsideOut = false;        ///< the whole surface faced inward

  bool changedAnything() const;
  std::string summary() const;  ///< "welded 12276 vertices to 2048; ..." or "nothing to repair"
};

struct RepairedMesh {
  TriMesh mesh;
  RepairReport report;
};

/// Cost O(n log n). Never throws on geometry: what stays wrong is inspectSurface's to say.
RepairedMesh repairMesh(const TriMesh& mesh, const RepairOptions& options = {});

}  // namespace polestar
