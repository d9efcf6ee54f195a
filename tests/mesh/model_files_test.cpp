// Every model of others against what MANIFEST.tsv says of it, which was found by other means (exact
// rationals).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>

#include "polestar/core/error.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/repair.h"
#include "support/meshes.h"

namespace polestar {
namespace {

using polestar::testing::ManifestEntry;
using ::testing::HasSubstr;

/// Number behind "name=" in the manifest's notes.
std::optional<std::size_t> noted(const ManifestEntry& entry, const std::string& name) {
  std::smatch match;
  if (!std::regex_search(entry.note, match, std::regex(name + "=([0-9]+)"))) return {};
  return std::stoul(match[1]);
}

bool isUnreadable(const ManifestEntry& entry) {
  return entry.star == "n/a" || entry.star.starts_with("unreadable");
}

/// Columns V and F: as they stand in the file, polygons cut into triangles.
std::pair<std::size_t, std::size_t> sizesInFile(const ManifestEntry& entry) {
  std::ifstream in(*testing::meshFolder() / "MANIFEST.tsv");
  for (std::string line; std::getline(in, line);) {
    std::stringstream cells(line);
    std::string name, cell;
    std::getline(cells, name, '\t');
    if (name != entry.path.filename()) continue;
    for (int skipped = 0; skipped < 2; ++skipped) std::getline(cells, cell, '\t');
    std::size_t vertices = 0, triangles = 0;
    cells >> vertices >> triangles;
    return {vertices, triangles};
  }
  return {};
}

RepairedMesh load(const std::string& name) {
  return repairMesh(readMesh(*testing::meshFolder() / name).mesh);
}

TEST(ModelFiles, SizesAsInTheManifest) {
  POLESTAR_REQUIRE_MESHES();
  for (const ManifestEntry& entry : testing::manifest()) {
    if (isUnreadable(entry)) continue;
    const MeshFile file = readMesh(entry.path);
    const auto [vertices, triangles] = sizesInFile(entry);
    EXPECT_EQ(file.mesh.vertices.size(), vertices) << entry.path;
    EXPECT_EQ(file.mesh.triangles.size(), triangles) << entry.path;
    EXPECT_EQ("." + file.format, entry.path.extension()) << entry.path;
  }
}

TEST(ModelFiles, VerdictsAsInTheManifest) {
  POLESTAR_REQUIRE_MESHES();
  int valid = 0;
  for (const ManifestEntry& entry : testing::manifest()) {
    if (isUnreadable(entry)) continue;
    const SurfaceReport report = inspectSurface(load(entry.path.filename()).mesh);
    SCOPED_TRACE(entry.path.filename().string() + ": " + report.defect);
    const bool sphere =
        entry.star == "yes" || (entry.star == "no" && entry.genus == 0 && entry.components == 1);
    EXPECT_EQ(report.valid, sphere);
    valid += report.valid;
    if (entry.closed) {
      EXPECT_EQ(report.boundaryEdges, 0u);
    } else {
      EXPECT_GT(report.boundaryEdges, 0u);
      EXPECT_GT(report.holeCount, 0u);
      EXPECT_THAT(report.defect, ::testing::ContainsRegex("the surface is open.*vertices \\(.*around \\("));
    }
    if (entry.closed && entry.genus) {
      EXPECT_EQ(report.components, entry.components);
      EXPECT_EQ(report.euler, 2 * entry.components - 2 * *entry.genus);
    }
    // suzanne and truck have seams that only welding closes, which the manifest did not do.
    const std::string name = entry.path.filename();
    if (const auto open = noted(entry, "boundary_edges");
        open && name != "suzanne.obj" && name != "truck.obj") {
      EXPECT_EQ(report.boundaryEdges, *open);
    }
    const auto edges = noted(entry, "nonmanifold_edges");
    if (name != "dup_faces.ply") {  // three duplicates, dropped
      EXPECT_EQ(report.nonManifoldEdgeCount, edges.value_or(0));
    }
  }
  EXPECT_GT(valid, 35);
}

TEST(ModelFiles, UnreadableOnesAreNamedByPlace) {
  POLESTAR_REQUIRE_MESHES();
  int unreadable = 0;
  for (const ManifestEntry& entry : testing::manifest()) {
    if (!isUnreadable(entry)) continue;
    ++unreadable;
    try {
      readMesh(entry.path);
      ADD_FAILURE() << entry.path << " was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::io);
      EXPECT_THAT(error.what(),
                  HasSubstr(entry.path.filename() == "castalia_nan.obj" ? "line 683: vertex 683: 'nan'"
                                                                        : "names vertex 391"));
    }
  }
  EXPECT_EQ(unreadable, 2);
}

TEST(ModelFiles, DamagedCopiesComeBackAsTheOriginal) {
  POLESTAR_REQUIRE_MESHES();
  const auto volume = [](const std::string& name) { return inspectSurface(load(name).mesh).volume; };
  const double castalia = volume("castalia.obj"), psyche = volume("psyche.obj"),
               itokawa = volume("itokawa_8.obj");
  EXPECT_NEAR(volume("castalia_far.obj"), castalia, 1e-8 * castalia);
  EXPECT_NEAR(volume("castalia_tiny.ply") * 1e21, castalia, 1e-5 * castalia);  // floats
  EXPECT_NEAR(volume("castalia_zero_area.obj"), castalia, 1e-7 * castalia);
  EXPECT_NEAR(volume("psyche_inverted.ply"), psyche, 1e-6 * psyche);  // floats
  EXPECT_NEAR(volume("psyche_mixed_orient.off"), psyche, 1e-6 * psyche);
  EXPECT_NEAR(volume("dup_faces.ply"), itokawa, 1e-6 * itokawa);  // floats
  for (const char* name : {"castalia_far.obj", "castalia_tiny.ply"}) {
    const RepairedMesh copy = load(name);
    EXPECT_FALSE(copy.report.changedAnything()) << copy.report.summary();
    EXPECT_EQ(copy.mesh.vertices.size(), 2048u);
  }
  EXPECT_TRUE(load("psyche_inverted.ply").report.turnedInsideOut);
  EXPECT_GT(load("psyche_mixed_orient.off").report.flippedTriangles, 0u);
  EXPECT_EQ(load("dup_faces.ply").report.duplicateTriangles, 3u);
  EXPECT_EQ(load("castalia_zero_area.obj").report.degenerateTriangles, 2u);
  EXPECT_FALSE(load("nested_cavity.obj").report.changedAnything());
}

TEST(ModelFiles, TheHoleOfKw4IsWhereItsTrianglesWereTaken) {
  POLESTAR_REQUIRE_MESHES();
  const SurfaceReport report = inspectSurface(load("kw4_hole.stl").mesh);
  ASSERT_EQ(report.holeCount, 1u);
  EXPECT_EQ(report.holes[0].vertices.size(), 7u);
  // Five triangles are missing: a closed loop of seven edges bounds a disk of five.
  EXPECT_EQ(inspectSurface(load("KW4Alpha.obj").mesh).triangles - report.triangles, 5u);
}

}  // namespace
}  // namespace polestar
