#pragma once
// Tetrahedra that fill bodies star-shaped about the origin: shells of prisms, each cut in three, and a cone
// around the origin.

#include <algorithm>
#include <utility>

#include "polestar/core/predicates.h"
#include "polestar/mesh/tet_mesh.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

/// The surface's vertices come first, scaled by 1; then those of the inner shells; the origin last.
inline TetMesh shells(const TriMesh& surface, int layers) {
  TetMesh mesh;
  const auto count = static_cast<std::int32_t>(surface.vertices.size());
  for (int layer = 0; layer < layers; ++layer) {
    const double scale = 1 - static_cast<double>(layer) / layers;
    for (const Vec3& v : surface.vertices) mesh.vertices.push_back(scale * v);
  }
  mesh.vertices.push_back(Vec3::Zero());
  const std::int32_t origin = count * layers;
  const auto add = [&](std::array<std::int32_t, 4> t) {
    const auto& v = mesh.vertices;
    if (orient3d(v[t[0]], v[t[1]], v[t[2]], v[t[3]]) < 0) std::swap(t[2], t[3]);
    mesh.addCell(CellShape::tetrahedron, t);
  };
  for (Triangle t : surface.triangles) {
    std::sort(t.begin(), t.end());  // neighbours cut their common side along the same diagonal
    const auto [a, b, c] = t;
    for (int layer = 0; layer + 1 < layers; ++layer) {
      const std::int32_t outer = layer * count, inner = outer + count;
      add({inner + a, inner + b, inner + c, outer + c});
      add({inner + a, inner + b, outer + b, outer + c});
      add({inner + a, outer + a, outer + b, outer + c});
    }
    const std::int32_t last = (layers - 1) * count;
    add({last + a, last + b, last + c, origin});
  }
  return mesh;
}

/// One of every shape, on the corners of a cube and a point above it; labels and data of every kind.
inline TetMesh zoo() {
  TetMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.push_back(Vec3(i & 1, i >> 1 & 1, i >> 2 & 1) / 3);
  mesh.vertices.push_back({0.1, -1e-7, 1e6 + 1e-9});
  const auto add = [&](CellShape shape, std::initializer_list<std::int32_t> corners) {
    mesh.addCell(shape, std::vector<std::int32_t>(corners));
  };
  add(CellShape::edge, {0, 8});
  add(CellShape::triangle, {0, 2, 1});
  add(CellShape::quad, {4, 5, 7, 6});
  add(CellShape::tetrahedron, {0, 1, 2, 4});
  add(CellShape::tetrahedron, {3, 1, 7, 2});
  add(CellShape::pyramid, {4, 5, 7, 6, 8});
  add(CellShape::wedge, {0, 1, 2, 4, 5, 6});
  add(CellShape::hexahedron, {0, 1, 3, 2, 4, 5, 7, 6});
  return mesh;
}

}  // namespace polestar::testing
