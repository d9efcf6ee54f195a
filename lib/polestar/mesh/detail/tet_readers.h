#pragma once
// One reader a format of tetrahedral meshes, and what they share.

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "polestar/mesh/detail/mesh_source.h"
#include "polestar/mesh/detail/mixed_values.h"
#include "polestar/mesh/read_tet_mesh.h"

namespace polestar::detail {

/// What readTetMesh does once the file is in memory. @throws Error{Errc::io}
TetMeshFile parseTetMesh(MeshSource source);

TetMeshFile parseVtk(const MeshSource& source);
TetMeshFile parseMedit(const MeshSource& source);
TetMeshFile parseGmsh(const MeshSource& source);
TetMeshFile parseTetgen(const MeshSource& nodes, const MeshSource& elements);

/// No claim reserves more than the file can fill, at two bytes a value.
inline std::size_t believable(std::int64_t claimed, const MeshSource& source) {
  return std::min(static_cast<std::size_t>(claimed), source.bytes.size() / 2);
}

/// "tetrahedron 3: a corner is vertex 17, but ..."
std::string badCorner(std::int64_t number, std::int64_t first, std::size_t vertexCount, const Item& cell);

/// Index from 0 of a corner that the file counts from `first`.
/// @throws Error{Errc::io} when there is no such vertex.
std::int32_t checkedCorner(std::int64_t number, std::int64_t first, std::size_t vertexCount, const Item& cell,
                           const MixedValues& values);

/// Cells of a format that keeps them by kind, or as they come, each with up to two whole numbers as labels.
class LabelledCells {
 public:
  explicit LabelledCells(std::vector<std::string> labelNames) : names_(std::move(labelNames)) {}
  void add(TetMesh& mesh, CellShape shape, std::span<const std::int32_t> corners,
           std::span<const std::int64_t> labels);
  /// Adds the labels to the mesh as cell data; those that are 0 throughout say nothing and are left out.
  void finish(TetMesh& mesh);

 private:
  std::vector<std::string> names_;
  std::vector<std::vector<double>> labels_ = std::vector<std::vector<double>>(names_.size());
};

}  // namespace polestar::detail
