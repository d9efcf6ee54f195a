// Thousands of damaged files, seeded: a mesh that keeps its promises or an Error{Errc::io} comes out.
#include <gtest/gtest.h>

#include "mesh/mutator.h"
#include "mesh/tet_bodies.h"
#include "polestar/core/error.h"
#include "polestar/mesh/detail/tet_readers.h"
#include "polestar/mesh/shapes.h"
#include "polestar/mesh/write_tet_mesh.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using namespace polestar::testing;

/// Whether the bytes were read.
bool survives(const std::string& name, const std::string& bytes, const std::string& elements = {}) {
  TetMeshFile file;
  try {
    file = elements.empty() ? detail::parseTetMesh({name, bytes})
                            : detail::parseTetgen({name, bytes}, {name, elements});
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io) << error.what();
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
    return false;
  }
  const TetMesh& mesh = file.mesh;
  EXPECT_FALSE(mesh.shapes.empty());
  std::size_t corners = 0;
  for (const CellShape shape : mesh.shapes) corners += cornerCount(shape);
  EXPECT_EQ(corners, mesh.corners.size());
  for (const std::int32_t v : mesh.corners)
    EXPECT_TRUE(v >= 0 && v < static_cast<std::int32_t>(mesh.vertices.size()));
  for (const Vec3& v : mesh.vertices) EXPECT_TRUE(v.allFinite());
  const auto expectSizes = [](const std::vector<MeshData>& all, std::size_t owners) {
    for (const MeshData& data : all)
      EXPECT_EQ(data.values.size(), owners * static_cast<std::size_t>(data.components)) << data.name;
  };
  expectSizes(mesh.vertexData, mesh.vertices.size());
  expectSizes(mesh.cellData, mesh.cellCount());
  return true;
}

TEST(TetMutation, DamagedFilesEndInAMeshOrAMessage) {
#ifdef POLESTAR_SANITIZED
  constexpr int kRounds = 300;
#else
  constexpr int kRounds = 4000;
#endif
  TetMesh mesh = zoo();
  MeshData labels{"region", 1, true, false, {}}, wind{"wind", 3, false, false, {}};
  for (std::size_t i = 0; i < mesh.cellCount(); ++i) labels.values.push_back(static_cast<double>(i));
  for (std::size_t i = 0; i < 3 * mesh.vertices.size(); ++i)
    wind.values.push_back(0.1 * static_cast<double>(i));
  mesh.cellData = {labels};
  mesh.vertexData = {wind};
  mesh.groups = {{3, 1, "rock"}};
  const test::ScratchFolder folder;
  std::vector<std::pair<std::string, std::string>> files;
  const auto add = [&](const std::string& name, bool binary) {
    writeTetMesh(folder / name, mesh, {.binary = binary, .comment = "a comment"});
    files.push_back({name, test::bytesOf(folder / name)});
  };
  add("text.vtk", false);
  add("bytes.vtk", true);
  add("a.mesh", false);
  add("a.msh", false);
  files.push_back(
      {"five.vtk",
       "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 "
       "0 1 0\n0 0 1\nMETADATA\nINFORMATION 0\n\nCELLS 2 4\nOFFSETS vtktypeint64\n0 "
       "4\nCONNECTIVITY vtktypeint64\n0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\nFIELD f 1\na 2 1 "
       "float\n1 2\n"});
  files.push_back(
      {"four.msh",
       "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n2 0 0 0 1 1 1 1 7 0\n"
       "$EndEntities\n$Nodes\n1 4 1 4\n3 2 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
       "$Elements\n1 1 1 1\n3 2 4 1\n1 1 2 3 4\n$EndElements\n"});
  for (std::size_t f = 0; f < files.size(); ++f) {
    const auto& [name, bytes] = files[f];
    ASSERT_TRUE(survives(name, bytes)) << name;
    Mutator mutate(static_cast<unsigned>(300 + f));
    int read = 0;
    for (int round = 0; round < kRounds; ++round) {
      read += survives(name, mutate(bytes));
      if (HasFailure()) FAIL() << name << ", round " << round;
    }
    // Both outcomes must occur, or the test tests nothing.
    EXPECT_GT(read, 0) << name;
    EXPECT_LT(read, kRounds) << name;
  }
}

TEST(TetMutation, TetgensPair) {
  const std::string nodes = "4 3 1 1\n0 0 0 0 0.5 1\n1 1 0 0 0.5 1\n2 0 1 0 0.5 1\n3 0 0 1 0.5 0\n";
  const std::string elements = "1 4 1\n0 0 1 2 3 7\n";
  ASSERT_TRUE(survives("a.node", nodes, elements));
  Mutator mutate(400);
  int read = 0;
  for (int round = 0; round < 2000; ++round) {
    read += survives("a.node", mutate(nodes), elements) + survives("a.node", nodes, mutate(elements));
    if (HasFailure()) FAIL() << "round " << round;
  }
  EXPECT_GT(read, 0);
  EXPECT_LT(read, 4000);
}

TEST(TetMutation, RandomBytesUnderEveryName) {
  std::mt19937 random(19);
  for (int round = 0; round < 1000; ++round) {
    std::string bytes(1 + random() % 300, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    for (const char* magic : {"", "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\n",
                              "# vtk DataFile Version 5.1\nt\nASCII\n", "MeshVersionFormatted 2\n",
                              "$MeshFormat\n2.2 0 8\n", "$MeshFormat\n4.1 1 8\n\1\0\0\0"}) {
      for (const char* name : {"a.vtk", "a.mesh", "a.msh"}) survives(name, magic + bytes);
    }
  }
}

}  // namespace
}  // namespace polestar
