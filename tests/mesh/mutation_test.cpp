// Thousands of damaged files, seeded: whatever comes in, a mesh that keeps its promises or an Error{Errc::io}
// comes out.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "mesh/bodies.h"
#include "mesh/mesh_bytes.h"
#include "mesh/mutator.h"
#include "polestar/core/error.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/repair.h"

namespace polestar {
namespace {

using namespace polestar::testing;

std::string stripsFile() {
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement vertex 12\nproperty float x\nproperty float y\n"
      "property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  const TriMesh body = icosphere(0);
  for (const Vec3& v : body.vertices) {
    for (int k = 0; k < 3; ++k) bytes += raw(static_cast<float>(v[k]), std::endian::big);
  }
  bytes += raw(static_cast<std::int32_t>(4 * body.triangles.size()), std::endian::big);
  for (const Triangle& t : body.triangles) {
    for (const std::int32_t v : t) bytes += raw(v, std::endian::big);
    bytes += raw(std::int32_t{-1}, std::endian::big);
  }
  return bytes;
}

/// Whether the bytes were read; then repair and inspection must cope with the result.
bool survives(const std::string& name, const std::string& bytes) {
  MeshFile file;
  try {
    file = parse(name, bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io) << error.what();
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
    return false;
  }
  EXPECT_FALSE(file.mesh.triangles.empty());
  for (const Vec3& v : file.mesh.vertices) EXPECT_TRUE(v.allFinite());
  for (const Triangle& t : file.mesh.triangles) {
    for (const std::int32_t v : t)
      EXPECT_TRUE(v >= 0 && v < static_cast<std::int32_t>(file.mesh.vertices.size()));
  }
  const RepairedMesh repaired = repairMesh(file.mesh);
  const SurfaceReport report = inspectSurface(repaired.mesh);
  EXPECT_EQ(report.valid, report.defect.empty());
  EXPECT_EQ(report.malformedCount, 0u);
  return true;
}

TEST(Mutation, DamagedFilesEndInAMeshOrAMessage) {
#ifdef POLESTAR_SANITIZED
  constexpr int kRounds = 300;
#else
  constexpr int kRounds = 6000;
#endif
  const TriMesh body = icosphere(0);
  std::string polygons =
      "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nv 0 0 2\n"
      "f 1 4 3 2\nf -5 -4 -3 9 -2\nf 1/1/1 2/2/2 6/3/3 5/4/4\nf 2//1 3//1 7//1 6//1\nf 3 4 8 7\nf 4 1 5 8\n";
  const std::vector<std::pair<std::string, std::string>> files{
      {"a.obj", objText(body)},
      {"polygons.obj", polygons},
      {"a.off", offText(body)},
      {"a.ply", plyText(body)},
      {"little.ply", plyBinary<float>(body, std::endian::little)},
      {"big.ply", plyBinary<double>(body, std::endian::big)},
      {"strips.ply", stripsFile()},
      {"text.stl", stlText(body)},
      {"binary.stl", stlBinary(body)},
  };
  for (std::size_t f = 0; f < files.size(); ++f) {
    const auto& [name, bytes] = files[f];
    ASSERT_TRUE(survives(name, bytes)) << name;
    Mutator mutate(static_cast<unsigned>(100 + f));
    int read = 0;
    for (int round = 0; round < kRounds; ++round) {
      const std::string damaged = mutate(bytes);
      read += survives(name, damaged);
      if (HasFailure()) FAIL() << name << ", round " << round;
    }
    // Both outcomes must occur, or the test tests nothing.
    EXPECT_GT(read, 0) << name;
    EXPECT_LT(read, kRounds) << name;
  }
}

TEST(Mutation, RandomBytesUnderEveryName) {
  std::mt19937 random(9);
  for (int round = 0; round < 2000; ++round) {
    std::string bytes(1 + random() % 300, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    for (const char* name : {"a.obj", "a.ply", "a.stl", "a.off", "a"}) {
      for (const char* magic : {"", "ply\n", "OFF\n", "solid "}) survives(name, magic + bytes);
    }
  }
}

}  // namespace
}  // namespace polestar
