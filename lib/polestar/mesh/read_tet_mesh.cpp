#include "polestar/mesh/read_tet_mesh.h"

#include <algorithm>

#include "polestar/mesh/detail/mesh_bytes_out.h"
#include "polestar/mesh/detail/tet_readers.h"

namespace polestar {
namespace detail {
std::string badCorner(std::int64_t number, std::int64_t first, std::size_t vertexCount, const Item& cell) {
  const auto last = first + static_cast<std::int64_t>(vertexCount) - 1;
  return std::string(cell.kind) + " " + std::to_string(cell.number) + ": a corner is vertex " +
         std::to_string(number) + ", but " +
         (vertexCount == 0 ? "no vertices stand before it"
                           : "vertices run from " + std::to_string(first) + " to " + std::to_string(last)) +
         "; the file is damaged, export it again";
}

std::int32_t checkedCorner(std::int64_t number, std::int64_t first, std::size_t vertexCount, const Item& cell,
                           const MixedValues& values) {
  if (number < first || number - first >= static_cast<std::int64_t>(vertexCount))
    values.fail(badCorner(number, first, vertexCount, cell));
  return static_cast<std::int32_t>(number - first);
}

void LabelledCells::add(TetMesh& mesh, CellShape shape, std::span<const std::int32_t> corners,
                        std::span<const std::int64_t> labels) {
  mesh.addCell(shape, corners);
  for (std::size_t k = 0; k < names_.size(); ++k) {
    labels_[k].push_back(k < labels.size() ? static_cast<double>(labels[k]) : 0.0);
  }
}

void LabelledCells::finish(TetMesh& mesh) {
  for (std::size_t k = 0; k < names_.size(); ++k) {
    if (std::all_of(labels_[k].begin(), labels_[k].end(), [](double label) { return label == 0; })) continue;
    MeshData data;
    data.name = names_[k];
    data.whole = true;
    data.values = std::move(labels_[k]);
    mesh.cellData.push_back(std::move(data));
  }
}

TetMeshFile parseTetMesh(MeshSource source) {
  const std::string extension = lowerExtension(source.path);
  if (extension == ".meshb") {
    source.fail("binary Medit files (.meshb) are not read; save it as text, with the ending .mesh");
  }
  prepareMeshSource(source);
  TetMeshFile file = [&] {
    if (extension == ".vtk") return parseVtk(source);
    if (extension == ".mesh") return parseMedit(source);
    if (extension == ".msh") return parseGmsh(source);
    source.fail("its name does not end in .vtk, .mesh, .msh, .node or .ele");
  }();
  if (file.mesh.shapes.empty())
    source.fail("it holds no cells; export the mesh of the solid, not its points");
  return file;
}

}  // namespace detail

bool isTetMeshName(const std::filesystem::path& path) {
  const std::string extension = detail::lowerExtension(path);
  return extension == ".vtk" || extension == ".mesh" || extension == ".meshb" || extension == ".msh" ||
         extension == ".node" || extension == ".ele";
}

TetMeshFile readTetMesh(const std::filesystem::path& path) {
  const std::string extension = detail::lowerExtension(path);
  if (extension != ".node" && extension != ".ele") return detail::parseTetMesh(detail::loadMeshSource(path));
  // TetGen's pair: either name stands for both.
  auto nodes = path, elements = path;
  nodes.replace_extension(".node");
  elements.replace_extension(".ele");
  return detail::parseTetgen(detail::loadMeshSource(nodes), detail::loadMeshSource(elements));
}

}  // namespace polestar
