// Meshes of solids as other programs write them, and what is said of bad ones.
#include "polestar/mesh/read_tet_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mesh/mesh_bytes.h"
#include "polestar/mesh/detail/tet_readers.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using namespace polestar::testing;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TetMeshFile parseTets(const std::string& name, std::string bytes) {
  return detail::parseTetMesh(detail::MeshSource{name, std::move(bytes)});
}

std::string errorOf(const std::string& name, std::string bytes) {
  try {
    parseTets(name, std::move(bytes));
  } catch (const Error& error) {
    if (error.code() == Errc::io) return error.what();
  }
  return {};
}

std::vector<std::int32_t> cornersOf(const TetMesh& mesh) { return mesh.corners; }

// As `tetgen -k` writes it.
const std::string kTetgenVtk =
    "# vtk DataFile Version 2.0\nUnstructured Grid\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1e0\n\nCELLS 2 10\n4    0     1     2     3\n4    4     3     2     "
    "1\n\n"
    "CELL_TYPES 2\n10\n10\n\nCELL_DATA 2\nSCALARS cell_scalars int 1\nLOOKUP_TABLE default\n7\n-8\n";

TEST(ReadTetMesh, VtkOfTetgen) {
  const TetMeshFile file = parseTets("a.vtk", kTetgenVtk);
  EXPECT_EQ(file.format, "vtk");
  EXPECT_FALSE(file.binary);
  EXPECT_THAT(file.left, IsEmpty());
  ASSERT_EQ(file.mesh.vertices.size(), 5u);
  EXPECT_EQ(file.mesh.vertices[4], Vec3(1, 1, 1));
  EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 1, 2, 3, 4, 3, 2, 1));
  ASSERT_EQ(file.mesh.cellData.size(), 1u);
  EXPECT_EQ(file.mesh.cellData[0].name, "cell_scalars");
  EXPECT_TRUE(file.mesh.cellData[0].whole);
  EXPECT_THAT(file.mesh.cellData[0].values, ElementsAre(7, -8));
  EXPECT_EQ(file.mesh.tetrahedra().corners.size(), 2u);
}

// ParaView's layout since 5.8, with what it puts beside: metadata, fields, color tables.
const std::string kNewVtk =
    "# vtk DataFile Version 5.1\nvtk output\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    "FIELD FieldData 1\nTimeValue 1 1 double\n0.5\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0\n0 0 1\n"
    "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n"
    "CELLS 3 7\nOFFSETS vtktypeint64\n0 4 7\nCONNECTIVITY vtktypeint64\n0 1 2 3 0\n2 1\nCELL_TYPES 2\n10\n5\n"
    "POINT_DATA 4\nSCALARS heat float\nLOOKUP_TABLE warm\n1 2 nan 4\nLOOKUP_TABLE warm 1\n0 0.5 1 1\n"
    "VECTORS wind double\n1 2 3 4 5 6 7 8 9 10 11 12\nNORMALS n float\n1 0 0 1 0 0 1 0 0 1 0 0\n"
    "FIELD FieldData 2\npair 2 4 int\n1 2 3 4 5 6 7 8\nMETADATA\nINFORMATION 0\n\n"
    "loose 1 3 double\n1 2 3\nCELL_DATA 2\nGLOBAL_IDS ids vtkIdType\n11 12\n";

TEST(ReadTetMesh, VtkOfVersionFive) {
  const TetMeshFile file = parseTets("a.vtk", kNewVtk);
  EXPECT_THAT(file.mesh.shapes, ElementsAre(CellShape::tetrahedron, CellShape::triangle));
  EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 1, 2, 3, 0, 2, 1));
  ASSERT_EQ(file.mesh.vertexData.size(), 4u);
  EXPECT_EQ(file.mesh.vertexData[0].name, "heat");
  EXPECT_TRUE(std::isnan(file.mesh.vertexData[0].values[2]));
  EXPECT_EQ(file.mesh.vertexData[1].components, 3);
  EXPECT_TRUE(file.mesh.vertexData[2].normals);
  EXPECT_EQ(file.mesh.vertexData[3].components, 2);
  ASSERT_EQ(file.mesh.cellData.size(), 1u);
  EXPECT_THAT(file.mesh.cellData[0].values, ElementsAre(11, 12));
  EXPECT_THAT(file.left, ElementsAre(HasSubstr("'TimeValue'"), HasSubstr("'warm'"), HasSubstr("'loose'")));
}

TEST(ReadTetMesh, VtkOfTetgenThatCountsFromOne) {
  std::string shifted = kTetgenVtk;
  const std::string cells = "4    0     1     2     3\n4    4     3     2     1\n";
  shifted.replace(shifted.find(cells), cells.size(), "4    1     2     3     4\n4    5     4     3     2\n");
  const TetMeshFile file = parseTets("a.vtk", shifted);
  EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 1, 2, 3, 4, 3, 2, 1));
  EXPECT_THAT(file.notes, ElementsAre(HasSubstr("from 1")));
  EXPECT_THAT(parseTets("a.vtk", kTetgenVtk).notes, IsEmpty());
}

std::string binaryVtk(const std::string& version) {
  std::string bytes =
      "# vtk DataFile Version " + version + "\nbytes\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n";
  for (const double x : {0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 0.1}) bytes += raw(x, std::endian::big);
  if (version[0] == '5') {
    bytes += "\nCELLS 2 4\nOFFSETS vtktypeint64\n";
    for (const std::int64_t i : {0, 4}) bytes += raw(i, std::endian::big);
    bytes += "\nCONNECTIVITY vtktypeint64\n";
    for (const std::int64_t i : {0, 1, 2, 3}) bytes += raw(i, std::endian::big);
  } else {
    bytes += "\nCELLS 1 5\n";
    for (const std::int32_t i : {4, 0, 1, 2, 3}) bytes += raw(i, std::endian::big);
  }
  bytes += "\nCELL_TYPES 1\n" + raw(std::int32_t{10}, std::endian::big);
  bytes +=
      "\nCELL_DATA 1\nSCALARS region short\nLOOKUP_TABLE default\n" + raw(std::int16_t{-3}, std::endian::big);
  return bytes + "\nFIELD FieldData 1\nhue 3 1 unsigned_char\n\x01\xFF\n\n";
}

TEST(ReadTetMesh, VtkAsBytes) {
  for (const char* version : {"3.0", "4.2", "5.1"}) {
    SCOPED_TRACE(version);
    const TetMeshFile file = parseTets("a.vtk", binaryVtk(version));
    EXPECT_TRUE(file.binary);
    EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 1, 2, 3));
    EXPECT_EQ(file.mesh.vertices[3].z(), 0.1);
    ASSERT_EQ(file.mesh.cellData.size(), 2u);
    EXPECT_THAT(file.mesh.cellData[0].values, ElementsAre(-3));
    EXPECT_THAT(file.mesh.cellData[1].values, ElementsAre(1, 255, 10));
  }
}

// As `tetgen -g` writes it.
const std::string kMedit =
    "MeshVersionFormatted 1\n\nDimension\n3\n\n\n# Set of mesh vertices\nVertices\n4\n"
    "0  0  0    0\n1  0  0    5\n0  1  0    0\n0  0  1    0\n\n# Set of Triangles\nTriangles\n1\n"
    "    1      3      2     2\n# Set of Tetrahedra\nTetrahedra\n1\n    1     2     3     4    1\n\n"
    "Corners\n2\n 1\n 4\n\nNormals\n1\n0 0 1\n\nEdges\n1\n 1 2 9\n\nEnd\n";

TEST(ReadTetMesh, MeditOfTetgen) {
  const TetMeshFile file = parseTets("a.mesh", kMedit);
  EXPECT_EQ(file.format, "medit");
  EXPECT_THAT(file.mesh.shapes, ElementsAre(CellShape::triangle, CellShape::tetrahedron, CellShape::edge));
  EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 2, 1, 0, 1, 2, 3, 0, 1));
  ASSERT_EQ(file.mesh.cellData.size(), 1u);
  EXPECT_EQ(file.mesh.cellData[0].name, "medit:ref");
  EXPECT_THAT(file.mesh.cellData[0].values, ElementsAre(2, 1, 9));
  ASSERT_EQ(file.mesh.vertexData.size(), 1u);
  EXPECT_THAT(file.mesh.vertexData[0].values, ElementsAre(0, 5, 0, 0));
  ASSERT_EQ(file.mesh.marks.size(), 1u);
  EXPECT_THAT(file.mesh.marks[0].numbers, ElementsAre(1, 4));
  EXPECT_THAT(file.left, ElementsAre(HasSubstr("Normals")));
}

const std::string kGmsh2 =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"the rock\"\n$EndPhysicalNames\n"
    "$Nodes\n4\n10 0 0 0\n20 1 0 0\n30 0 1 0\n15 0 0 1\n$EndNodes\n"
    "$Elements\n3\n1 15 2 0 1 10\n2 2 2 5 6 10 30 20\n9 4 4 7 3 1 1 10 20 30 15\n$EndElements\n"
    "$NodeData\n1\n\"heat flux\"\n1\n0.5\n3\n0\n1\n2\n10 1.5\n15 -2\n$EndNodeData\n"
    "$Periodic\n0\n$EndPeriodic\n"
    "$ElementData\n1\n\"stress\"\n1\n0\n4\n0\n3\n1\n0\n9 1 2 3\n$EndElementData\n";

TEST(ReadTetMesh, GmshTwo) {
  const TetMeshFile file = parseTets("a.msh", kGmsh2);
  EXPECT_EQ(file.format, "gmsh");
  EXPECT_THAT(file.mesh.shapes, ElementsAre(CellShape::point, CellShape::triangle, CellShape::tetrahedron));
  EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 0, 2, 1, 0, 1, 2, 3));
  ASSERT_EQ(file.mesh.cellData.size(), 3u);
  EXPECT_EQ(file.mesh.cellData[0].name, "stress");
  EXPECT_EQ(file.mesh.cellData[1].name, "gmsh:physical");
  EXPECT_THAT(file.mesh.cellData[1].values, ElementsAre(0, 5, 7));
  EXPECT_THAT(file.mesh.cellData[2].values, ElementsAre(1, 6, 3));
  ASSERT_EQ(file.mesh.vertexData.size(), 1u);
  EXPECT_EQ(file.mesh.vertexData[0].name, "heat flux");
  EXPECT_EQ(file.mesh.vertexData[0].values[3], -2);
  EXPECT_TRUE(std::isnan(file.mesh.vertexData[0].values[1]));
  ASSERT_EQ(file.mesh.groups.size(), 1u);
  EXPECT_EQ(file.mesh.groups[0].name, "the rock");
  EXPECT_THAT(file.left, ElementsAre(HasSubstr("$Periodic")));
}

std::string binaryGmsh2(std::endian order) {
  const auto ints = [&](std::initializer_list<std::int32_t> values) {
    std::string bytes;
    for (const std::int32_t value : values) bytes += raw(value, order);
    return bytes;
  };
  std::string bytes = "$MeshFormat\n2.2 1 8\n" + ints({1}) + "\n$EndMeshFormat\n$Nodes\n4\n";
  for (std::int32_t i = 0; i < 4; ++i) {
    bytes += ints({i + 1});
    for (int k = 0; k < 3; ++k) bytes += raw(i == k + 1 ? 0.1 : 0.0, order);
  }
  bytes += "\n$EndNodes\n$Elements\n3\n" + ints({2, 2, 2, 1, 5, 6, 1, 3, 2, 2, 5, 6, 1, 2, 4});
  return bytes + ints({4, 1, 2, 3, 7, 8, 1, 2, 3, 4}) + "\n$EndElements\n";
}

TEST(ReadTetMesh, GmshTwoAsBytes) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    const TetMeshFile file = parseTets("a.msh", binaryGmsh2(order));
    EXPECT_TRUE(file.binary);
    EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 2, 1, 0, 1, 3, 0, 1, 2, 3));
    EXPECT_EQ(file.mesh.vertices[3], Vec3(0, 0, 0.1));
    EXPECT_THAT(file.mesh.cellData[0].values, ElementsAre(5, 5, 7));
  }
}

const std::string kGmsh4 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n1 0 1 1\n1 0 0 0 0\n"
    "4 0 0 0 1 1 1 1 5 0\n2 0 0 0 1 1 1 2 7 8 1 4\n$EndEntities\n"
    "$Nodes\n2 4 1 40\n2 4 1 1\n10\n0 0 0 0.5 0.5\n3 2 0 3\n20\n30\n40\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
    "$Elements\n2 2 1 2\n2 4 2 1\n1 10 30 20\n3 2 4 1\n2 10 20 30 40\n$EndElements\n";

TEST(ReadTetMesh, GmshFour) {
  const TetMeshFile file = parseTets("a.msh", kGmsh4);
  EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 2, 1, 0, 1, 2, 3));
  EXPECT_EQ(file.mesh.vertices[3], Vec3(0, 0, 1));
  ASSERT_EQ(file.mesh.cellData.size(), 2u);
  EXPECT_THAT(file.mesh.cellData[0].values, ElementsAre(5, 7));
  EXPECT_THAT(file.mesh.cellData[1].values, ElementsAre(4, 2));
}

TEST(ReadTetMesh, GmshFourAsBytes) {
  const auto ints = [](std::initializer_list<std::int32_t> values) {
    std::string bytes;
    for (const std::int32_t value : values) bytes += raw(value);
    return bytes;
  };
  const auto sizes = [](std::initializer_list<std::int64_t> values) {
    std::string bytes;
    for (const std::int64_t value : values) bytes += raw(value);
    return bytes;
  };
  std::string bytes = "$MeshFormat\n4.1 1 8\n" + ints({1}) + "\n$EndMeshFormat\n$Nodes\n" +
                      sizes({1, 4, 1, 4}) + ints({3, 1, 0}) + sizes({4, 1, 2, 3, 4});
  for (std::int32_t i = 0; i < 4; ++i) {
    for (int k = 0; k < 3; ++k) bytes += raw(i == k + 1 ? 0.1 : 0.0);
  }
  bytes += "\n$EndNodes\n$Elements\n" + sizes({1, 1, 1, 1}) + ints({3, 1, 4}) + sizes({1, 1, 1, 2, 3, 4}) +
           "\n$EndElements\n";
  const TetMeshFile file = parseTets("a.msh", bytes);
  EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(file.mesh.vertices[2], Vec3(0, 0.1, 0));
}

TEST(ReadTetMesh, TetgensPairCountedFromZeroOrOne) {
  const test::ScratchFolder folder;
  for (const int first : {0, 1}) {
    const auto number = [&](int i) { return std::to_string(i + first) + " "; };
    test::writeBytes(folder / "a.node", "4  3  1  1\n" + number(0) + "0 0 0 0.5 1\n" + number(1) +
                                            "1 0 0 0.5 1\n# between\n" + number(2) + "0 1 0 0.25 1\n" +
                                            number(3) + "0 0 1 0 0\n# Generated by tetgen\n");
    test::writeBytes(folder / "a.ele",
                     "1  4  1\n" + number(0) + number(0) + number(1) + number(2) + number(3) + "12\n");
    for (const char* name : {"a.node", "a.ele"}) {
      const TetMeshFile file = readTetMesh(folder / name);
      EXPECT_EQ(file.format, "tetgen");
      EXPECT_THAT(cornersOf(file.mesh), ElementsAre(0, 1, 2, 3));
      EXPECT_EQ(file.mesh.cellData[0].name, "tetgen:ref");
      EXPECT_TRUE(file.mesh.cellData[0].whole);
      EXPECT_EQ(file.mesh.vertexData.size(), 2u);
    }
  }
  std::filesystem::remove(folder / "a.node");
  EXPECT_THROW(readTetMesh(folder / "a.ele"), Error);
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(ReadTetMesh, SaysWhatIsWrongAndWhere) {
  const auto expectError = [](const std::string& name, const std::string& bytes,
                              std::initializer_list<const char*> words) {
    const std::string message = errorOf(name, bytes);
    EXPECT_THAT(message, HasSubstr(name));
    for (const char* word : words) EXPECT_THAT(message, HasSubstr(word));
  };
  expectError("a.vtk", replaced(kTetgenVtk, "4    0     1", "4    0     5"),
              {"cell 1", "vertex 5", "0 to 4"});
  expectError("a.vtk", replaced(kTetgenVtk, "1 1 1e0", "1 1 nan"), {"line 10", "point 5", "'nan'"});
  expectError("a.vtk", replaced(kTetgenVtk, "CELLS 2 10", "CELLS 2 9"), {});
  expectError("a.vtk", replaced(kTetgenVtk, "10\n10\n", "10\n24\n"), {"cell 2", "VTK type 24"});
  expectError("a.vtk", replaced(kTetgenVtk, "10\n10\n", "10\n12\n"), {"cell 2", "hexahedron", "4 corners"});
  expectError("a.vtk", replaced(kTetgenVtk, "UNSTRUCTURED_GRID", "POLYDATA"), {"'POLYDATA'", ".ply"});
  expectError("a.vtk", kTetgenVtk.substr(0, 150), {"truncated"});
  expectError("a.vtk", "<VTKFile type=\"UnstructuredGrid\">", {"XML"});
  expectError("a.vtk", binaryVtk("3.0").substr(0, 200), {"byte", "truncated"});
  expectError("a.vtk", replaced(kTetgenVtk, "POINTS 5", "POINTS 999999999"), {"line"});
  expectError("a.vtk", replaced(binaryVtk("3.0"), "POINTS 4", "POINTS 2147483647"), {"truncated"});
  expectError("a.mesh", replaced(kMedit, "1     2     3     4", "1     2     3     0"),
              {"line 22", "tetrahedron 1", "vertex 0", "1 to 4"});
  expectError("a.mesh", replaced(kMedit, "Dimension\n3", "Dimension\n2"), {"three coordinates"});
  expectError("a.mesh", kMedit.substr(0, kMedit.find("Triangles")), {"no cells"});
  expectError("a.meshb", "\x01", {"binary Medit", ".mesh"});
  expectError("a.msh", replaced(kGmsh2, "10 20 30 15", "10 20 30 16"), {"element 3", "node 16"});
  expectError("a.msh", replaced(kGmsh2, "20 1 0 0", "10 1 0 0"), {"node 10", "twice"});
  expectError("a.msh", replaced(kGmsh2, "9 4 4", "9 11 4"), {"gmsh's type 11", "order 1"});
  expectError("a.msh", replaced(kGmsh2, "2.2 0 8", "4.0 0 8"), {"'4.0'", "msh22"});
  expectError("a.msh", replaced(kGmsh2, "20 1 0 0", "20 1 0 inf"), {"node 20", "infinite"});
  expectError("a.msh", kGmsh4.substr(0, kGmsh4.find("$EndElements") - 4), {"truncated"});
  expectError("a.vtk", "\x1F\x8B\x08", {"compressed"});
  EXPECT_THAT(errorOf("a.mesh", kTetgenVtk), HasSubstr("MeshVersionFormatted"));
  EXPECT_THAT(errorOf("a.msh", kTetgenVtk), HasSubstr("$MeshFormat"));
}

TEST(ReadTetMesh, NamesItKnows) {
  for (const char* name : {"a.vtk", "a.VTK", "b/a.mesh", "a.msh", "a.node", "a.ele", "a.meshb"})
    EXPECT_TRUE(isTetMeshName(name)) << name;
  for (const char* name : {"a.obj", "vtk", "a.vtu", "a"}) EXPECT_FALSE(isTetMeshName(name)) << name;
}

}  // namespace
}  // namespace polestar
