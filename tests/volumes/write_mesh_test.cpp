#include "polestar/mesh/write_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "polestar/core/error.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;

class WriteMesh : public ::testing::TestWithParam<const char*> {
 protected:
  fs::path file() const {
    return fs::path(::testing::TempDir()) / (std::string("polestar_written") + GetParam());
  }
  void TearDown() override { fs::remove(file()); }
};

TEST_P(WriteMesh, ReadsBackToTheLastBit) {
  TriMesh mesh = icosphere(2);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    mesh.vertices[i] *= std::pow(10.0, static_cast<double>(i % 13) - 6) / 3;
  }
  mesh.vertices[0] = {1e6 + 1e-9, -5e-324, 1.7976931348623157e308};
  writeMesh(file(), mesh, "two lines\nof comment");
  const MeshFile back = readMesh(file());
  EXPECT_EQ(back.mesh.vertices, mesh.vertices);
  EXPECT_EQ(back.mesh.triangles, mesh.triangles);
  EXPECT_EQ(back.format, std::string(GetParam()).substr(1));
}

TEST_P(WriteMesh, SaysWhyItCannot) {
  try {
    writeMesh(fs::path("/nonexistent") / (std::string("a") + GetParam()), icosphere(0));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_THAT(error.what(), ::testing::HasSubstr("/nonexistent"));
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, WriteMesh, ::testing::Values(".obj", ".ply", ".off"),
                         [](const auto& test) { return std::string(test.param + 1); });

TEST(WriteMeshName, MustEndInAKnownFormat) {
  for (const char* name : {"a.stp", "a", "a.obj.txt"}) {
    try {
      writeMesh(fs::path(::testing::TempDir()) / name, icosphere(0));
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage);
    }
  }
}

}  // namespace
}  // namespace polestar
