#include "polestar/mesh/write_tet_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/mesh/detail/mesh_bytes_out.h"

namespace polestar {
namespace {

using detail::appendBytes;
using detail::appendText;

/// Names without blanks, as words of a file.
std::string word(const std::string& name) {
  std::string result = name.empty() ? "data" : name;
  std::replace_if(
      result.begin(), result.end(), [](char c) { return c <= ' ' || c == '"' || c == 127; }, '_');
  return result;
}

template <class Numbers>
void appendRow(std::string& out, const Numbers& numbers) {
  bool first = true;
  for (const auto& number : numbers) {
    if (!first) out += ' ';
    appendText(out, number);
    first = false;
  }
  out += '\n';
}

void appendPoint(std::string& out, const Vec3& v) { appendRow(out, std::array{v[0], v[1], v[2]}); }

/// Calls visit(cell, shape, corners) for every cell.
template <class Visit>
void forEachCell(const TetMesh& mesh, Visit&& visit) {
  std::size_t at = 0;
  for (std::size_t cell = 0; cell < mesh.shapes.size(); ++cell) {
    const std::size_t count = cornerCount(mesh.shapes[cell]);
    visit(cell, mesh.shapes[cell], std::span(mesh.corners).subspan(at, count));
    at += count;
  }
}

constexpr std::array<int, kCellShapes> kVtkTypes{1, 3, 5, 9, 10, 14, 13, 12};
constexpr std::array<int, kCellShapes> kGmshTypes{15, 1, 2, 3, 4, 7, 6, 5};
constexpr std::array<const char*, kCellShapes> kMeditKeywords{
    nullptr, "Edges", "Triangles", "Quadrilaterals", "Tetrahedra", "Pyramids", "Prisms", "Hexahedra"};

// --- which data become labels ----------------------------------------------------------------------------

bool isLabel(const MeshData& data) {
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  return data.whole && data.components == 1 &&
         std::all_of(data.values.begin(), data.values.end(), [](double v) { return std::abs(v) <= kMost; });
}

/// The data of the first of these names that can be labels, else the first that can; nothing when none can.
const MeshData* chooseLabel(const std::vector<MeshData>& all, std::initializer_list<const char*> names,
                            const MeshData* taken = nullptr) {
  for (const char* name : names) {
    for (const MeshData& data : all) {
      if (data.name == name && isLabel(data) && &data != taken) return &data;
    }
  }
  for (const MeshData& data : all) {
    if (isLabel(data) && &data != taken) return &data;
  }
  return nullptr;
}

std::int64_t labelAt(const MeshData* labels, std::size_t i) {
  return labels ? static_cast<std::int64_t>(labels->values[i]) : 0;
}

const MeshData* meditLabel(const std::vector<MeshData>& all) {
  return chooseLabel(all, {"medit:ref", "gmsh:physical", "tetgen:ref"});
}
const MeshData* physicalTag(const TetMesh& mesh) {
  return chooseLabel(mesh.cellData, {"gmsh:physical", "medit:ref", "tetgen:ref"});
}
/// gmsh wants both tags; without a second one the first serves twice.
const MeshData* geometricalTag(const TetMesh& mesh) {
  for (const MeshData& data : mesh.cellData) {
    if (data.name == "gmsh:geometrical" && isLabel(data)) return &data;
  }
  return physicalTag(mesh);
}

bool fitsGmsh(const MeshData& data) {
  return data.components == 1 || data.components == 3 || data.components == 9;
}

// --- VTK -------------------------------------------------------------------------------------------------

class VtkBytes {
 public:
  VtkBytes(const TetMesh& mesh, const TetMeshWriting& options) : mesh_(mesh), binary_(options.binary) {
    std::string title = options.comment.substr(0, options.comment.find('\n')).substr(0, 255);
    if (title.empty()) title = "mesh";
    out_ = "# vtk DataFile Version 3.0\n" + title + (binary_ ? "\nBINARY\n" : "\nASCII\n") +
           "DATASET UNSTRUCTURED_GRID\n";
  }

  std::string bytes() && {
    line("POINTS", mesh_.vertices.size(), "double");
    for (const Vec3& v : mesh_.vertices) {
      if (!binary_) {
        appendPoint(out_, v);
        continue;
      }
      for (int k = 0; k < 3; ++k) appendBytes(out_, v[k], std::endian::big);
    }
    out_ += '\n';
    line("CELLS", mesh_.cellCount(), std::to_string(mesh_.corners.size() + mesh_.cellCount()));
    forEachCell(mesh_, [&](std::size_t, CellShape, std::span<const std::int32_t> corners) {
      integer(static_cast<std::int32_t>(corners.size()), false);
      for (std::size_t k = 0; k < corners.size(); ++k) integer(corners[k], k + 1 == corners.size());
    });
    out_ += '\n';
    line("CELL_TYPES", mesh_.cellCount(), "");
    for (const CellShape shape : mesh_.shapes) integer(kVtkTypes[static_cast<std::size_t>(shape)], true);
    out_ += '\n';
    section("POINT_DATA", mesh_.vertices.size(), mesh_.vertexData);
    section("CELL_DATA", mesh_.cellCount(), mesh_.cellData);
    return std::move(out_);
  }

 private:
  void line(const char* keyword, std::size_t count, const std::string& rest) {
    out_ += std::string(keyword) + " " + std::to_string(count) + (rest.empty() ? "" : " " + rest) + "\n";
  }

  void integer(std::int32_t value, bool last) {
    if (binary_) {
      appendBytes(out_, value, std::endian::big);
      return;
    }
    appendText(out_, value);
    out_ += last ? '\n' : ' ';
  }

  void section(const char* keyword, std::size_t count, const std::vector<MeshData>& all) {
    if (all.empty()) return;
    line(keyword, count, "");
    for (const MeshData& data : all) {
      if (data.normals) {
        out_ += "NORMALS " + word(data.name) + " double\n";
      } else if (data.components == 1) {
        out_ += "SCALARS " + word(data.name) + " " + type(data) + " 1\nLOOKUP_TABLE default\n";
      } else {
        out_ += "FIELD FieldData 1\n" + word(data.name) + " " + std::to_string(data.components) + " " +
                std::to_string(count) + " " + type(data) + "\n";
      }
      values(data);
      out_ += '\n';
    }
  }

  static bool isLong(const MeshData& data) {
    return std::any_of(data.values.begin(), data.values.end(),
                       [](double v) { return std::abs(v) > std::numeric_limits<std::int32_t>::max(); });
  }
  static std::string type(const MeshData& data) {
    if (!data.whole) return "double";
    return isLong(data) ? "long" : "int";
  }

  void values(const MeshData& data) {
    const bool isWide = data.whole && isLong(data);
    for (std::size_t i = 0; i < data.values.size(); ++i) {
      const double value = data.values[i];
      if (!binary_) {
        data.whole ? appendText(out_, static_cast<std::int64_t>(value)) : appendText(out_, value);
        out_ += (i + 1) % static_cast<std::size_t>(data.components) == 0 ? '\n' : ' ';
      } else if (isWide) {
        appendBytes(out_, static_cast<std::int64_t>(value), std::endian::big);
      } else if (data.whole) {
        appendBytes(out_, static_cast<std::int32_t>(value), std::endian::big);
      } else {
        appendBytes(out_, value, std::endian::big);
      }
    }
  }

  const TetMesh& mesh_;
  const bool binary_;
  std::string out_;
};

// --- Medit -----------------------------------------------------------------------------------------------

std::string meditBytes(const TetMesh& mesh, const std::string& comment) {
  std::string out =
      "MeshVersionFormatted 2\n" + detail::commentLines(comment, "# ") + "\nDimension 3\n\nVertices\n";
  const MeshData* vertexLabels = meditLabel(mesh.vertexData);
  const MeshData* cellLabels = meditLabel(mesh.cellData);
  appendRow(out, std::array{mesh.vertices.size()});
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    appendPoint(out, mesh.vertices[i]);
    out.back() = ' ';
    appendRow(out, std::array{labelAt(vertexLabels, i)});
  }
  for (std::size_t kind = 1; kind < kCellShapes; ++kind) {
    const auto shape = static_cast<CellShape>(kind);
    const std::size_t count = mesh.count(shape);
    if (count == 0) continue;
    out += std::string("\n") + kMeditKeywords[kind] + "\n";
    appendRow(out, std::array{count});
    forEachCell(mesh, [&](std::size_t cell, CellShape found, std::span<const std::int32_t> corners) {
      if (found != shape) return;
      for (const std::int32_t corner : corners) {
        appendText(out, corner + 1);
        out += ' ';
      }
      appendRow(out, std::array{labelAt(cellLabels, cell)});
    });
  }
  for (const MeditMarks& marks : mesh.marks) {
    out += "\n" + marks.keyword + "\n";
    appendRow(out, std::array{marks.numbers.size()});
    for (const std::int64_t number : marks.numbers) appendRow(out, std::array{number});
  }
  return out + "\nEnd\n";
}

// --- gmsh ------------------------------------------------------------------------------------------------

void appendGmshData(std::string& out, const char* section, const MeshData& data, std::size_t owners) {
  const auto components = static_cast<std::size_t>(data.components);
  const auto given = [&](std::size_t i) {
    const auto row = std::span(data.values).subspan(i * components, components);
    return std::none_of(row.begin(), row.end(), [](double v) { return std::isnan(v); });
  };
  std::size_t rows = 0;
  for (std::size_t i = 0; i < owners; ++i) rows += given(i);
  out += "$" + std::string(section) + "\n1\n\"" + word(data.name) + "\"\n1\n0\n3\n0\n";
  appendRow(out, std::array{components});
  appendRow(out, std::array{rows});
  for (std::size_t i = 0; i < owners; ++i) {
    if (!given(i)) continue;
    appendText(out, i + 1);
    out += ' ';
    appendRow(out, std::span(data.values).subspan(i * components, components));
  }
  out += "$End" + std::string(section) + "\n";
}

std::string gmshBytes(const TetMesh& mesh, const std::string& comment) {
  std::string out = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
  if (!comment.empty()) out += "$Comments\n" + detail::commentLines(comment, "") + "$EndComments\n";
  if (!mesh.groups.empty()) {
    out += "$PhysicalNames\n";
    appendRow(out, std::array{mesh.groups.size()});
    for (const GroupName& group : mesh.groups) {
      out += std::to_string(group.dimension) + " " + std::to_string(group.tag) + " \"" + group.name + "\"\n";
    }
    out += "$EndPhysicalNames\n";
  }
  out += "$Nodes\n";
  appendRow(out, std::array{mesh.vertices.size()});
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    appendText(out, i + 1);
    out += ' ';
    appendPoint(out, mesh.vertices[i]);
  }
  out += "$EndNodes\n$Elements\n";
  appendRow(out, std::array{mesh.cellCount()});
  const MeshData *physical = physicalTag(mesh), *geometrical = geometricalTag(mesh);
  forEachCell(mesh, [&](std::size_t cell, CellShape shape, std::span<const std::int32_t> corners) {
    const std::array<std::int64_t, 5> head{static_cast<std::int64_t>(cell) + 1,
                                           kGmshTypes[static_cast<std::size_t>(shape)], 2,
                                           labelAt(physical, cell), labelAt(geometrical, cell)};
    appendRow(out, head);
    out.back() = ' ';
    for (const std::int32_t corner : corners) {
      appendText(out, corner + 1);
      out += ' ';
    }
    out.back() = '\n';
  });
  out += "$EndElements\n";
  for (const MeshData& data : mesh.vertexData) {
    if (fitsGmsh(data)) appendGmshData(out, "NodeData", data, mesh.vertices.size());
  }
  for (const MeshData& data : mesh.cellData) {
    if (&data != physical && &data != geometrical && fitsGmsh(data))
      appendGmshData(out, "ElementData", data, mesh.cellCount());
  }
  return out;
}

void checkName(const std::filesystem::path& path) {
  if (isTetMeshOutputName(path)) return;
  throw Error(Errc::usage,
              "cannot write " + path.string() + ": meshes of solids are written as .vtk, .mesh or .msh");
}

void noteLost(std::vector<std::string>& lost, const std::vector<MeshData>& all, const char* owner,
              const auto& keeps) {
  for (const MeshData& data : all) {
    if (!keeps(data)) lost.push_back(std::string(owner) + " data " + word(data.name));
  }
}

}  // namespace

bool isTetMeshOutputName(const std::filesystem::path& path) {
  const std::string extension = detail::lowerExtension(path);
  return extension == ".vtk" || extension == ".mesh" || extension == ".msh";
}

std::vector<std::string> lostInTetMeshFile(const std::filesystem::path& path, const TetMesh& mesh) {
  checkName(path);
  const std::string extension = detail::lowerExtension(path);
  std::vector<std::string> lost;
  if (extension == ".mesh") {
    const MeshData *vertexLabels = meditLabel(mesh.vertexData), *cellLabels = meditLabel(mesh.cellData);
    noteLost(lost, mesh.vertexData, "vertex", [&](const MeshData& data) { return &data == vertexLabels; });
    noteLost(lost, mesh.cellData, "cell", [&](const MeshData& data) { return &data == cellLabels; });
    if (const std::size_t points = mesh.count(CellShape::point); points > 0)
      lost.push_back(std::to_string(points) + " cells that are single points");
  }
  if (extension == ".msh") {
    noteLost(lost, mesh.vertexData, "vertex", fitsGmsh);
    noteLost(lost, mesh.cellData, "cell", fitsGmsh);
  } else if (!mesh.groups.empty()) {
    lost.push_back("the names of " + std::to_string(mesh.groups.size()) + " physical groups");
  }
  if (extension != ".mesh") {
    for (const MeditMarks& marks : mesh.marks) lost.push_back("the section " + marks.keyword);
  }
  return lost;
}

std::vector<std::string> writeTetMesh(const std::filesystem::path& path, const TetMesh& mesh,
                                      const TetMeshWriting& options) {
  std::vector<std::string> lost = lostInTetMeshFile(path, mesh);
  const std::string extension = detail::lowerExtension(path);
  if (extension == ".vtk") {
    detail::writeWhole(path, VtkBytes(mesh, options).bytes());
  } else if (extension == ".mesh") {
    detail::writeWhole(path, meditBytes(mesh, options.comment));
  } else {
    detail::writeWhole(path, gmshBytes(mesh, options.comment));
  }
  return lost;
}

}  // namespace polestar
