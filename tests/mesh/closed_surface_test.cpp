#include "polestar/mesh/closed_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>

#include "mesh/bodies.h"
#include "polestar/core/error.h"

namespace polestar {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using namespace polestar::testing;

TEST(ClosedSurface, BodiesByFormulaAreValid) {
  for (const TriMesh& body : {icosphere(0), icosphere(3), cube(1), cube(5), halfBall(4), smoothStar(3)}) {
    const SurfaceReport report = inspectSurface(body);
    EXPECT_TRUE(report.valid) << report.defect;
    EXPECT_EQ(report.euler, 2);
    EXPECT_EQ(report.genus, 0);
    EXPECT_EQ(report.components, 1);
    EXPECT_EQ(report.edges, body.triangles.size() * 3 / 2);
    EXPECT_EQ(verifyClosedSurface(body).mesh().triangles, body.triangles);
  }
  EXPECT_NEAR(inspectSurface(cube(3)).volume, 8, 1e-13);
}

TEST(ClosedSurface, PlaceAndSizeDoNotMatter) {
  for (const double scale : {1e-30, 1e-7, 1e12}) {
    const TriMesh moved =
        transformed(icosphere(2), [&](const Vec3& v) { return Vec3(scale * (v + Vec3(1e5, 0, -1e4))); });
    EXPECT_TRUE(inspectSurface(moved).valid) << inspectSurface(moved).defect;
  }
}

TEST(ClosedSurface, AHoleIsNamedByItsLoop) {
  // The star of an original corner of the icosahedron: a ring of five vertices around it.
  const TriMesh whole = icosphere(2);
  const SurfaceReport report = inspectSurface(withoutStar(whole, 0));
  ASSERT_EQ(report.holeCount, 1u);
  EXPECT_EQ(report.boundaryEdges, 5u);
  ASSERT_EQ(report.holes[0].vertices.size(), 5u);
  // In order: each next one is joined to the one before by an edge of the whole mesh, and to vertex 0.
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  for (const Triangle& t : whole.triangles) {
    for (int k = 0; k < 3; ++k) edges.insert({t[k], t[(k + 1) % 3]});
  }
  double length = 0;
  Vec3 center = Vec3::Zero();
  for (int i = 0; i < 5; ++i) {
    const std::int32_t v = report.holes[0].vertices[i], next = report.holes[0].vertices[(i + 1) % 5];
    EXPECT_TRUE(edges.contains({v, next}));
    EXPECT_TRUE(edges.contains({v, 0}));
    length += (whole.vertices[next] - whole.vertices[v]).norm();
    center += whole.vertices[v] / 5;
  }
  EXPECT_NEAR(report.holes[0].length, length, 1e-14);
  EXPECT_LT((report.holes[0].center - center).norm(), 1e-14);
  EXPECT_FALSE(report.valid);
  EXPECT_EQ(report.genus, -1);
  EXPECT_THAT(report.defect, AllOf(StartsWith("the surface is open, 1 hole with 5 boundary edges"),
                                   HasSubstr("5 vertices"), HasSubstr("fill")));
}

TEST(ClosedSurface, HolesAreCountedCompletelyAndListedLongestFirst) {
  TriMesh mesh = icosphere(3);
  // The twelve corners of the icosahedron, far from each other; then one larger hole.
  for (std::int32_t v = 0; v < 12; ++v) mesh = withoutStar(mesh, v);
  const SurfaceReport twelve = inspectSurface(mesh);
  EXPECT_EQ(twelve.holeCount, 12u);
  EXPECT_EQ(twelve.boundaryEdges, 60u);
  EXPECT_EQ(twelve.holes.size(), SurfaceReport::kMaxListed);
  for (const std::int32_t v : std::vector<std::int32_t>(twelve.holes[0].vertices))
    mesh = withoutStar(mesh, v);
  const SurfaceReport larger = inspectSurface(mesh);
  EXPECT_EQ(larger.holeCount, 12u);
  EXPECT_EQ(larger.holes[0].vertices.size(), 10u);
  EXPECT_EQ(larger.unusedVertexCount, 17u);
  EXPECT_THAT(larger.defect, AllOf(HasSubstr("12 holes with 65 boundary edges"), HasSubstr("the longest")));
}

TEST(ClosedSurface, HolesThatTouchAreTwoLoops) {
  // Two opposite triangles of a vertex with six are missing.
  TriMesh mesh = icosphere(2);
  const std::int32_t v = 100;
  std::vector<std::size_t> star;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (std::count(mesh.triangles[t].begin(), mesh.triangles[t].end(), v)) star.push_back(t);
  }
  ASSERT_EQ(star.size(), 6u);
  const Triangle first = mesh.triangles[star[0]];
  const auto opposite = std::find_if(star.begin(), star.end(), [&](std::size_t t) {
    return std::ranges::none_of(mesh.triangles[t],
                                [&](std::int32_t w) { return w != v && std::ranges::count(first, w); });
  });
  // Of the three triangles that share only v with the first, take one that leaves two triangles on either
  // side.
  std::vector<std::size_t> far;
  for (const std::size_t t : star) {
    if (std::ranges::none_of(mesh.triangles[t],
                             [&](std::int32_t w) { return w != v && std::ranges::count(first, w); }))
      far.push_back(t);
  }
  ASSERT_EQ(far.size(), 3u);
  ASSERT_NE(opposite, star.end());
  mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(std::max(star[0], far[1])));
  mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(std::min(star[0], far[1])));
  const SurfaceReport report = inspectSurface(mesh);
  EXPECT_EQ(report.boundaryEdges, 6u);
  ASSERT_EQ(report.holeCount, 2u);
  EXPECT_EQ(report.holes[0].vertices.size(), 3u);
  EXPECT_EQ(report.holes[1].vertices.size(), 3u);
  EXPECT_EQ(report.nonManifoldVertices, std::vector<std::int32_t>{v});
}

TEST(ClosedSurface, AFin) {
  TriMesh mesh = icosphere(1);
  const auto [a, b, c] = mesh.triangles[7];
  mesh.vertices.push_back({3, 3, 3});
  mesh.triangles.push_back({a, b, static_cast<std::int32_t>(mesh.vertices.size() - 1)});
  const SurfaceReport report = inspectSurface(mesh);
  EXPECT_EQ(report.nonManifoldEdgeCount, 1u);
  EXPECT_EQ(report.nonManifoldEdges[0], (std::array{std::min(a, b), std::max(a, b)}));
  EXPECT_EQ(report.boundaryEdges, 2u);
  EXPECT_EQ(report.holes[0].vertices.size(), 3u);  // a path from edge end to edge end
  EXPECT_THAT(report.defect, AllOf(StartsWith("1 edge belongs to three or more triangles"),
                                   HasSubstr("besides: the surface is open")));
}

TEST(ClosedSurface, ABowTieVertex) {
  // Two spheres that share one vertex: closed, every edge in order, and yet no manifold.
  TriMesh mesh = together(icosphere(1),
                          transformed(icosphere(1), [](const Vec3& v) { return Vec3(v + Vec3(2, 0, 0)); }));
  for (Triangle& t : mesh.triangles) std::replace(t.begin(), t.end(), 45, 4);
  mesh.vertices[45] = {0, 0, 0};
  const SurfaceReport report = inspectSurface(mesh);
  EXPECT_EQ(report.boundaryEdges + report.nonManifoldEdgeCount + report.misorientedEdgeCount, 0u);
  EXPECT_EQ(report.nonManifoldVertices, std::vector<std::int32_t>{4});
  EXPECT_EQ(report.components, 2);
  EXPECT_THAT(report.defect, AllOf(StartsWith("1 vertex joins sheets"), HasSubstr("vertex 4 at"),
                                   HasSubstr("2 separate parts")));
}

TEST(ClosedSurface, TwoBodies) {
  const SurfaceReport report = inspectSurface(together(
      icosphere(1), transformed(icosphere(0), [](const Vec3& v) { return Vec3(v + Vec3(9, 0, 0)); })));
  EXPECT_EQ(report.components, 2);
  EXPECT_EQ(report.genus, -1);
  EXPECT_THAT(report.defect,
              AllOf(StartsWith("2 separate parts: 80 triangles from vertex"), HasSubstr("20 triangles")));
}

TEST(ClosedSurface, ATorus) {
  const SurfaceReport report = inspectSurface(torus());
  EXPECT_EQ(report.genus, 1);
  EXPECT_EQ(report.euler, 0);
  EXPECT_THAT(report.defect, AllOf(StartsWith("the surface has genus 1"), HasSubstr("tunnel")));
}

TEST(ClosedSurface, OneSidedSurfaces) {
  const SurfaceReport strip = inspectSurface(moebiusStrip(15));
  EXPECT_EQ(strip.holeCount, 1u);
  EXPECT_EQ(strip.boundaryEdges, 30u);
  EXPECT_EQ(strip.holes[0].vertices.size(), 30u);  // one rim, twice around
  EXPECT_GT(strip.misorientedEdgeCount, 0u);
  EXPECT_FALSE(strip.valid);
  const SurfaceReport klein = inspectSurface(kleinBottle());
  EXPECT_EQ(klein.boundaryEdges, 0u);
  EXPECT_EQ(klein.euler, 0);
  EXPECT_EQ(klein.genus, -1);
  EXPECT_THAT(klein.defect, HasSubstr("facing opposite ways"));
}

TEST(ClosedSurface, AnInwardSurface) {
  const SurfaceReport report = inspectSurface(insideOut(icosphere(1)));
  EXPECT_LT(report.volume, 0);
  EXPECT_THAT(report.defect, StartsWith("the surface faces inward"));
}

TEST(ClosedSurface, OneTurnedTriangle) {
  TriMesh mesh = icosphere(1);
  std::swap(mesh.triangles[9][0], mesh.triangles[9][1]);
  EXPECT_EQ(inspectSurface(mesh).misorientedEdgeCount, 3u);
  EXPECT_THAT(inspectSurface(mesh).defect, StartsWith("3 edges have two triangles facing opposite ways"));
}

TEST(ClosedSurface, DoubledSheetsEncloseNothing) {
  const TriMesh doubled{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  const SurfaceReport report = inspectSurface(doubled);
  EXPECT_EQ(report.genus, 0);  // topologically a sphere
  EXPECT_THAT(report.defect, StartsWith("the surface encloses no volume"));
  TriMesh twice = icosphere(1);
  twice.triangles.push_back(twice.triangles[5]);
  EXPECT_EQ(inspectSurface(twice).nonManifoldEdgeCount, 3u);
  EXPECT_FALSE(inspectSurface(twice).valid);
}

TEST(ClosedSurface, ZeroAreaAndUnusedVertices) {
  const TriMesh damaged = withZeroArea(cube(2), 0, 1);
  const SurfaceReport report = inspectSurface(damaged);
  EXPECT_EQ(report.zeroAreaTriangleCount, 1u);
  EXPECT_THAT(report.defect, StartsWith("1 triangle has no area"));
  TriMesh unused = icosphere(1);
  unused.vertices.push_back({0, 0, 0});
  EXPECT_EQ(inspectSurface(unused).euler, 2);
  EXPECT_THAT(inspectSurface(unused).defect, StartsWith("1 vertex belongs to no triangle"));
}

TEST(ClosedSurface, MalformedMeshesAreReportedNotWalked) {
  TriMesh mesh = icosphere(1);
  mesh.triangles[4][2] = 1'000'000;
  mesh.triangles[5][0] = -7;
  mesh.vertices[8][1] = std::numeric_limits<double>::infinity();
  const SurfaceReport report = inspectSurface(mesh);
  EXPECT_EQ(report.malformedCount, 3u);
  EXPECT_THAT(report.defect,
              AllOf(StartsWith("3 vertices or triangles are malformed"), HasSubstr("vertex 8")));
  TriMesh repeated = icosphere(1);
  repeated.triangles[0][1] = repeated.triangles[0][0];
  EXPECT_EQ(inspectSurface(repeated).malformedCount, 1u);
  EXPECT_THAT(inspectSurface({}).defect, StartsWith("there are no triangles"));
}

TEST(ClosedSurface, VerifyThrowsTheDefect) {
  try {
    verifyClosedSurface(torus());
    FAIL() << "a torus is no body of genus 0";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::invalidSurface);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("genus 1"), Not(HasSubstr("\n"))));
  }
}

}  // namespace
}  // namespace polestar
