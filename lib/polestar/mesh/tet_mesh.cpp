#include "polestar/mesh/tet_mesh.h"

#include <algorithm>

namespace polestar {

const char* nameOf(CellShape shape) {
  constexpr std::array<const char*, kCellShapes> kNames{"point",       "edge",    "triangle", "quad",
                                                        "tetrahedron", "pyramid", "wedge",    "hexahedron"};
  return kNames[static_cast<std::size_t>(shape)];
}

TetMesh::Tetrahedra TetMesh::tetrahedra() const {
  Tetrahedra found;
  std::size_t at = 0;
  for (std::size_t cell = 0; cell < shapes.size(); ++cell) {
    if (shapes[cell] == CellShape::tetrahedron) {
      found.corners.push_back({corners[at], corners[at + 1], corners[at + 2], corners[at + 3]});
      found.cells.push_back(cell);
    }
    at += cornerCount(shapes[cell]);
  }
  return found;
}

std::size_t TetMesh::count(CellShape shape) const {
  return static_cast<std::size_t>(std::count(shapes.begin(), shapes.end(), shape));
}

}  // namespace polestar
