#pragma once
// Meshes of solids: tetrahedra and whatever else a file of that kind holds beside them. What `warp` moves:
// the paper carries TetGen's mesh of the solid over to the ball. [Xia 2010, sec. 4.1, step 4]

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/types.h"

namespace polestar {

/// Linear cells, with their corners in VTK's order.
enum class CellShape : std::uint8_t { point, edge, triangle, quad, tetrahedron, pyramid, wedge, hexahedron };

inline constexpr std::size_t kCellShapes = 8;
/// Corners of a cell.
constexpr std::size_t cornerCount(CellShape shape) {
  constexpr std::array<std::size_t, kCellShapes> kCorners{1, 2, 3, 4, 4, 5, 6, 8};
  return kCorners[static_cast<std::size_t>(shape)];
}
/// 0 for points, 3 for solids.
constexpr int dimensionOf(CellShape shape) {
  constexpr std::array<int, kCellShapes> kDimensions{0, 1, 2, 2, 3, 3, 3, 3};
  return kDimensions[static_cast<std::size_t>(shape)];
}
const char* nameOf(CellShape shape);  ///< "tetrahedron"

/// Values at the vertices or cells of a mesh.
struct MeshData {
  std::string name;
  int components = 1;
  bool whole = false;          ///< integers, such as the number of a region
  bool normals = false;        ///< unit normals, which hold no longer once vertices have moved
  std::vector<double> values;  ///< components a vertex or cell, those of one side by side
};

/// A name that gmsh gives to a physical group.
struct GroupName {
  int dimension = 0;
  std::int64_t tag = 0;
  std::string name;
};

/// A list of vertices or cells that Medit's format knows by a keyword (Corners, RequiredEdges ...), counted
/// from 1 as the format does.
struct MeditMarks {
  std::string keyword;
  std::vector<std::int64_t> numbers;
};

struct TetMesh {
  std::vector<Vec3> vertices;
  std::vector<CellShape> shapes;      ///< one a cell, in the file's order
  std::vector<std::int32_t> corners;  ///< of all cells, one after the other
  std::vector<MeshData> vertexData, cellData;
  std::vector<GroupName> groups;
  std::vector<MeditMarks> marks;

  std::size_t cellCount() const { return shapes.size(); }
  void addCell(CellShape shape, std::span<const std::int32_t> cellCorners) {
    shapes.push_back(shape);
    corners.insert(corners.end(), cellCorners.begin(), cellCorners.end());
  }

  /// The tetrahedra among the cells.
  struct Tetrahedra {
    std::vector<std::array<std::int32_t, 4>> corners;
    std::vector<std::size_t> cells;  ///< their positions among all cells
  };
  Tetrahedra tetrahedra() const;
  /// How many cells have that shape.
  std::size_t count(CellShape shape) const;
};

}  // namespace polestar
