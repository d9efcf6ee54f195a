// TetGen's .node and .ele: a header of counts, then a line a vertex and a line a tetrahedron, with attributes
// and markers behind. Vertices are counted from 0 or 1, as the first line says.
#include "polestar/mesh/detail/tet_readers.h"

namespace polestar::detail {
namespace {

constexpr std::int64_t kMostColumns = 1000;

/// A table of whole or other numbers that follow an index and the geometry.
std::vector<MeshData> columns(std::int64_t attributes, const std::string& name, bool whole) {
  std::vector<MeshData> result(static_cast<std::size_t>(attributes));
  for (std::size_t k = 0; k < result.size(); ++k) {
    result[k].name = attributes == 1 ? name : name + std::to_string(k + 1);
    result[k].whole = whole;
  }
  return result;
}

std::int64_t columnCount(MixedValues& values, const char* what) {
  const std::int64_t count = values.count(what);
  if (count > kMostColumns) values.fail(std::string(what) + ": " + std::to_string(count));
  return count;
}

/// Returns the number of the first vertex.
std::int64_t readNodes(MixedValues& values, TetMesh& mesh) {
  const std::int64_t count = values.count("number of vertices");
  if (values.integer({"dimension", 1}) != 3) values.fail("its vertices are not of three coordinates");
  const std::int64_t attributes = columnCount(values, "number of attributes");
  const bool marked = values.count("number of markers") > 0;
  std::vector<MeshData> data = columns(attributes, "tetgen:attribute", false);
  MeshData markers = columns(1, "tetgen:marker", true)[0];
  std::int64_t first = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    const Item vertex{"vertex", static_cast<std::size_t>(i) + 1};
    const std::int64_t number = values.integer(vertex);
    if (i == 0) first = number;
    if (number != first + i || first < 0 || first > 1) {
      values.fail("vertex " + std::to_string(number) +
                  " is out of order; they are numbered from 0 or 1 without gaps");
    }
    const double x = values.number(vertex), y = values.number(vertex), z = values.number(vertex);
    mesh.vertices.push_back({x, y, z});
    for (MeshData& column : data) column.values.push_back(values.value(vertex));
    if (marked) markers.values.push_back(static_cast<double>(values.integer(vertex)));
  }
  mesh.vertexData = std::move(data);
  if (marked) mesh.vertexData.push_back(std::move(markers));
  return first;
}

void readElements(MixedValues& values, std::int64_t firstVertex, TetMesh& mesh) {
  const std::int64_t count = values.count("number of tetrahedra");
  const std::int64_t corners = values.integer({"corners a tetrahedron", 1});
  if (corners != 4) {
    values.fail("tetrahedra of " + std::to_string(corners) + " corners are not read; run tetgen without -o2");
  }
  const std::int64_t attributes = columnCount(values, "number of attributes");
  std::vector<MeshData> data = columns(attributes, "tetgen:ref", false);
  for (std::int64_t i = 0; i < count; ++i) {
    const Item cell{"tetrahedron", static_cast<std::size_t>(i) + 1};
    values.integer(cell);  // its number
    std::array<std::int32_t, 4> tetrahedron;
    for (std::int32_t& corner : tetrahedron) {
      corner = checkedCorner(values.integer(cell), firstVertex, mesh.vertices.size(), cell, values);
    }
    mesh.addCell(CellShape::tetrahedron, tetrahedron);
    for (MeshData& column : data) column.values.push_back(values.value(cell));
  }
  // Regions are numbers of any kind to TetGen; they mostly are whole.
  for (MeshData& column : data) {
    column.whole = std::all_of(column.values.begin(), column.values.end(), [](double value) {
      return value == std::floor(value) && std::abs(value) < 1e15;
    });
  }
  mesh.cellData = std::move(data);
}

}  // namespace

TetMeshFile parseTetgen(const MeshSource& nodes, const MeshSource& elements) {
  TetMeshFile file;
  file.format = "tetgen";
  MixedValues vertexValues(nodes, '#'), cellValues(elements, '#');
  const std::int64_t first = readNodes(vertexValues, file.mesh);
  readElements(cellValues, first, file.mesh);
  if (file.mesh.shapes.empty()) elements.fail("it holds no tetrahedra; mesh the solid first");
  return file;
}

}  // namespace polestar::detail
