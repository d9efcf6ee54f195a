#pragma once
// Is this triangle mesh the boundary of a solid ball-like body? The question comes before star-ness: open
// meshes, two bodies or doubled faces can have a non-empty kernel and still be no boundary. [Xia 2010,
// sec. 4.1, "a closed genus-0 surface"; topology first, as in docs/method.md]

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// One boundary loop of an open mesh.
struct Hole {
  std::vector<std::int32_t>
      vertices;                ///< in order along the loop, or along a path that ends at a non-manifold edge
  double length = 0;           ///< mesh units
  Vec3 center = Vec3::Zero();  ///< mean of the loop's vertices
};

/// Everything inspectSurface finds; lists hold at most `kMaxListed` entries, counts are complete.
struct SurfaceReport {
  static constexpr std::size_t kMaxListed = 8;

  bool valid = false;  ///< closed, connected, consistently oriented outward, vertex-manifold, genus 0, no
                       ///< zero-area triangle, no unused vertex
  std::size_t vertices = 0, triangles = 0, edges = 0;
  int euler = 0;       ///< V - E + F over used vertices
  int components = 0;  ///< connected by edges
  int genus = -1;      ///< of a closed connected manifold surface of consistent orientation, else -1

  std::size_t malformedCount = 0;  ///< NaN or infinite vertices, triangles with a repeated vertex or an index
                                   ///< out of range; unless 0, what needs sound triangles is not filled in
  std::size_t unusedVertexCount = 0;
  std::size_t zeroAreaTriangleCount = 0;
  std::vector<std::int32_t> zeroAreaTriangles;
  std::size_t boundaryEdges = 0, holeCount = 0;
  std::vector<Hole> holes;               ///< the longest ones
  std::size_t nonManifoldEdgeCount = 0;  ///< edges of three or more triangles
  std::vector<std::array<std::int32_t, 2>> nonManifoldEdges;
  std::size_t nonManifoldVertexCount = 0;  ///< vertices whose triangles form more than one fan
  std::vector<std::int32_t> nonManifoldVertices;
  std::size_t misorientedEdgeCount = 0;  ///< edges that their two triangles run through in the same direction
  std::vector<std::array<std::int32_t, 2>> misorientedEdges;
  double volume = 0;  ///< mesh units cubed; negative when inward

  /// The first defect in the order a user should mend them: what, how many, where (vertex ids and
  /// coordinates) and what to do, then the other defects in brief; empty when valid.
  std::string defect;
};

/// Cost O(n log n).
SurfaceReport inspectSurface(const TriMesh& mesh);

/// A mesh that was found closed, connected, outward-oriented, vertex-manifold and of genus 0. Cheap to copy.
class ClosedSurface {
 public:
  const TriMesh& mesh() const { return *mesh_; }  ///< mesh units
  const SurfaceReport& report() const { return *report_; }

 private:
  friend ClosedSurface verifyClosedSurface(TriMesh mesh);
  std::shared_ptr<const TriMesh> mesh_;
  std::shared_ptr<const SurfaceReport> report_;
};

/// The only way to a ClosedSurface.
/// @throws Error{Errc::invalidSurface} with SurfaceReport::defect as its message.
ClosedSurface verifyClosedSurface(TriMesh mesh);

}  // namespace polestar
