// Medit's .mesh as text: keywords, each with a count and its rows; what TetGen -g, gmsh and Mmg write.
#include <algorithm>
#include <array>
#include <cctype>

#include "polestar/mesh/detail/tet_readers.h"

namespace polestar::detail {
namespace {

struct CellKind {
  std::string_view keyword;
  CellShape shape;
};
constexpr std::array<CellKind, 8> kCells{{{"Edges", CellShape::edge},
                                          {"Triangles", CellShape::triangle},
                                          {"Quadrilaterals", CellShape::quad},
                                          {"Tetrahedra", CellShape::tetrahedron},
                                          {"Hexahedra", CellShape::hexahedron},
                                          {"Prisms", CellShape::wedge},
                                          {"Pentahedra", CellShape::wedge},
                                          {"Pyramids", CellShape::pyramid}}};

/// Lists of numbers of vertices, edges ... that stay true when vertices move.
constexpr std::array<std::string_view, 8> kMarks{"Corners",
                                                 "RequiredVertices",
                                                 "Ridges",
                                                 "RequiredEdges",
                                                 "RequiredTriangles",
                                                 "RequiredQuadrilaterals",
                                                 "RequiredTetrahedra",
                                                 "RequiredHexahedra"};

class MeditParser {
 public:
  explicit MeditParser(const MeshSource& source) : source_(source), values_(source, '#') {}

  TetMeshFile parse() {
    if (values_.word() != "MeshVersionFormatted")
      source_.fail("it does not begin with MeshVersionFormatted; is it a Medit file as text?");
    values_.integer({"version", 1});
    for (std::string_view keyword = values_.word(); keyword != "End"; keyword = values_.word()) {
      if (keyword.empty()) break;  // End is often left out
      section(keyword);
    }
    cells_.finish(mesh_);
    if (std::any_of(references_.values.begin(), references_.values.end(), [](double r) { return r != 0; }))
      mesh_.vertexData.push_back(std::move(references_));
    return {std::move(mesh_), "medit", false, std::move(left_), {}};
  }

 private:
  void section(std::string_view keyword) {
    if (keyword == "Dimension") {
      if (values_.integer({"dimension", 1}) != 3) values_.fail("its vertices are not of three coordinates");
    } else if (keyword == "Vertices") {
      readVertices();
    } else if (const auto kind =
                   std::find_if(kCells.begin(), kCells.end(),
                                [&](const CellKind& known) { return known.keyword == keyword; });
               kind != kCells.end()) {
      readCells(kind->shape);
    } else if (std::find(kMarks.begin(), kMarks.end(), keyword) != kMarks.end()) {
      readMarks(keyword);
    } else {
      skip(keyword);
    }
  }

  void readVertices() {
    if (!mesh_.vertices.empty()) values_.fail("a second block of Vertices");
    const std::int64_t count = values_.count("number of vertices");
    references_.name = "medit:ref";
    references_.whole = true;
    for (std::int64_t i = 0; i < count; ++i) {
      const Item vertex{"vertex", static_cast<std::size_t>(i) + 1};
      const double x = values_.number(vertex), y = values_.number(vertex), z = values_.number(vertex);
      mesh_.vertices.push_back({x, y, z});
      references_.values.push_back(static_cast<double>(values_.integer(vertex)));
    }
  }

  void readCells(CellShape shape) {
    const std::int64_t count = values_.count("number of cells");
    std::vector<std::int32_t> corners(cornerCount(shape));
    for (std::int64_t i = 0; i < count; ++i) {
      const Item cell{nameOf(shape), static_cast<std::size_t>(i) + 1};
      for (std::int32_t& corner : corners) {
        corner = checkedCorner(values_.integer(cell), 1, mesh_.vertices.size(), cell, values_);
      }
      const std::int64_t reference = values_.integer(cell);
      cells_.add(mesh_, shape, corners, {&reference, 1});
    }
  }

  void readMarks(std::string_view keyword) {
    MeditMarks marks{std::string(keyword), {}};
    const std::int64_t count = values_.count("number of marks");
    for (std::int64_t i = 0; i < count; ++i)
      marks.numbers.push_back(values_.integer({"mark", static_cast<std::size_t>(i) + 1}));
    mesh_.marks.push_back(std::move(marks));
  }

  /// Up to the next keyword: numbers are all that stands between two.
  void skip(std::string_view keyword) {
    if (!std::isalpha(static_cast<unsigned char>(keyword[0])))
      values_.fail(excerpt(keyword) + " where a keyword is due; the file is damaged, export it again");
    left_.push_back("its section " + excerpt(keyword));
    while (true) {
      const std::string_view next = values_.peek();
      if (next.empty()) return;
      const bool number =
          !std::isalpha(static_cast<unsigned char>(next[0])) || next == "nan" || next == "inf";
      if (!number) return;
      values_.word();
    }
  }

  const MeshSource& source_;
  MixedValues values_;
  TetMesh mesh_;
  LabelledCells cells_{{"medit:ref"}};
  MeshData references_;
  std::vector<std::string> left_;
};

}  // namespace

TetMeshFile parseMedit(const MeshSource& source) { return MeditParser(source).parse(); }

}  // namespace polestar::detail
