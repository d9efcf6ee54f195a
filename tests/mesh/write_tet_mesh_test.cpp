// What is written reads back: every bit of the vertices, every cell, and the labels that the format can hold.
#include "polestar/mesh/write_tet_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "mesh/tet_bodies.h"
#include "polestar/core/error.h"
#include "polestar/mesh/read_tet_mesh.h"
#include "polestar/mesh/shapes.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::zoo;

MeshData data(const std::string& name, int components, bool whole, std::size_t owners) {
  MeshData result;
  result.name = name;
  result.components = components;
  result.whole = whole;
  for (std::size_t i = 0; i < owners * static_cast<std::size_t>(components); ++i)
    result.values.push_back(whole ? static_cast<double>(i) - 3 : 1 / (static_cast<double>(i) + 3));
  return result;
}

const MeshData* find(const std::vector<MeshData>& all, const std::string& name) {
  for (const MeshData& one : all) {
    if (one.name == name) return &one;
  }
  return nullptr;
}

struct Form {
  const char* name;
  bool binary;
};

class WriteTetMesh : public ::testing::TestWithParam<Form> {
 protected:
  TetMeshFile roundTrip(const TetMesh& mesh) {
    lost_ = writeTetMesh(folder_ / GetParam().name, mesh,
                         {.binary = GetParam().binary, .comment = "two lines\nof comment"});
    return readTetMesh(folder_ / GetParam().name);
  }
  test::ScratchFolder folder_;
  std::vector<std::string> lost_;
};

TEST_P(WriteTetMesh, ReadsBackToTheLastBit) {
  TetMesh mesh = zoo();
  mesh.vertices[0] = {1e6 + 1e-9, -5e-324, 1.7976931348623157e308};
  mesh.cellData.push_back(data("medit:ref", 1, true, mesh.cellCount()));
  const TetMeshFile back = roundTrip(mesh);
  EXPECT_EQ(back.mesh.vertices, mesh.vertices);
  EXPECT_THAT(lost_, IsEmpty());
  EXPECT_THAT(back.left, ::testing::Each(HasSubstr("$Comments")));
  EXPECT_EQ(back.binary, GetParam().binary);
  // Medit keeps cells by kind, the zoo comes in that order but for its solids.
  for (std::size_t kind = 0; kind < kCellShapes; ++kind) {
    const auto shape = static_cast<CellShape>(kind);
    EXPECT_EQ(back.mesh.count(shape), mesh.count(shape)) << nameOf(shape);
  }
  EXPECT_EQ(back.mesh.tetrahedra().corners, mesh.tetrahedra().corners);
  if (std::string(GetParam().name) != "a.mesh") {
    EXPECT_EQ(back.mesh.shapes, mesh.shapes);
    EXPECT_EQ(back.mesh.corners, mesh.corners);
  }
}

TEST_P(WriteTetMesh, KeepsLabelsOfEveryCell) {
  TetMesh mesh = testing::shells(icosphere(0), 2);
  mesh.cellData.push_back(data("cell_scalars", 1, true, mesh.cellCount()));
  const TetMeshFile back = roundTrip(mesh);
  EXPECT_THAT(lost_, IsEmpty());
  const std::string name = GetParam().name;
  const MeshData* labels = find(back.mesh.cellData, name == "a.mesh"  ? "medit:ref"
                                                    : name == "a.msh" ? "gmsh:physical"
                                                                      : "cell_scalars");
  ASSERT_TRUE(labels);
  EXPECT_EQ(labels->values, mesh.cellData[0].values);
  EXPECT_TRUE(labels->whole);
}

TEST_P(WriteTetMesh, KeepsDataOrSaysSo) {
  TetMesh mesh = testing::shells(icosphere(0), 2);
  mesh.vertexData = {data("heat flux", 1, false, mesh.vertices.size()),
                     data("wind", 3, false, mesh.vertices.size())};
  mesh.vertexData[0].values[5] = std::numeric_limits<double>::quiet_NaN();
  mesh.cellData = {data("pair", 2, true, mesh.cellCount())};
  mesh.groups = {{3, 1, "rock"}};
  mesh.marks = {{"Corners", {1, 4}}};
  const TetMeshFile back = roundTrip(mesh);
  const std::string name = GetParam().name;
  EXPECT_EQ(lostInTetMeshFile(name, mesh), lost_);
  if (name == "a.mesh") {
    EXPECT_THAT(lost_, ElementsAre(HasSubstr("heat_flux"), HasSubstr("wind"), HasSubstr("pair"),
                                   HasSubstr("1 physical group")));
    ASSERT_EQ(back.mesh.marks.size(), 1u);
    EXPECT_THAT(back.mesh.marks[0].numbers, ElementsAre(1, 4));
    return;
  }
  const MeshData* heat = find(back.mesh.vertexData, "heat_flux");
  ASSERT_TRUE(heat);
  EXPECT_TRUE(std::isnan(heat->values[5]));
  EXPECT_EQ(heat->values[6], mesh.vertexData[0].values[6]);
  EXPECT_EQ(find(back.mesh.vertexData, "wind")->values, mesh.vertexData[1].values);
  if (name == "a.msh") {
    EXPECT_THAT(lost_, ElementsAre(HasSubstr("pair"), HasSubstr("Corners")));
    EXPECT_EQ(back.mesh.groups[0].name, "rock");
  } else {
    EXPECT_THAT(lost_, ElementsAre(HasSubstr("physical"), HasSubstr("Corners")));
    EXPECT_EQ(find(back.mesh.cellData, "pair")->values, mesh.cellData[0].values);
  }
}

TEST_P(WriteTetMesh, SaysWhyItCannot) {
  try {
    writeTetMesh(std::filesystem::path("/nonexistent") / GetParam().name, zoo());
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_THAT(error.what(), HasSubstr("/nonexistent"));
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, WriteTetMesh,
                         ::testing::Values(Form{"a.vtk", false}, Form{"a.vtk", true}, Form{"a.mesh", false},
                                           Form{"a.msh", false}),
                         [](const auto& test) {
                           return std::string(test.param.name + 2) + (test.param.binary ? "Binary" : "");
                         });

TEST(WriteTetMeshName, MustEndInAKnownFormat) {
  for (const char* name : {"a.node", "a.vtu", "a", "a.meshb"}) {
    EXPECT_FALSE(isTetMeshOutputName(name));
    try {
      writeTetMesh(std::filesystem::path(::testing::TempDir()) / name, zoo());
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage);
    }
  }
}

TEST(WriteTetMeshTags, GmshsTagsSurviveAmongOthers) {
  const test::ScratchFolder folder;
  TetMesh mesh = testing::shells(icosphere(0), 1);
  mesh.cellData = {data("other", 1, true, mesh.cellCount()),
                   data("gmsh:geometrical", 1, true, mesh.cellCount()),
                   data("gmsh:physical", 1, true, mesh.cellCount())};
  mesh.cellData[1].values.assign(mesh.cellCount(), 4);
  mesh.cellData[2].values.assign(mesh.cellCount(), 9);
  writeTetMesh(folder / "a.msh", mesh);
  const TetMesh back = readTetMesh(folder / "a.msh").mesh;
  EXPECT_EQ(find(back.cellData, "gmsh:geometrical")->values, mesh.cellData[1].values);
  EXPECT_EQ(find(back.cellData, "gmsh:physical")->values, mesh.cellData[2].values);
  EXPECT_EQ(find(back.cellData, "other")->values, mesh.cellData[0].values);
}

}  // namespace
}  // namespace polestar
