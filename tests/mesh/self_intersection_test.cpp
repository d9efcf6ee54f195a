// Surfaces that run through themselves, and such that only look like it.
#include "polestar/mesh/self_intersection.h"

#include <gtest/gtest.h>

#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"
#include "support/meshes.h"

namespace polestar {
namespace {

void append(TriMesh& mesh, const TriMesh& other, const Vec3& shift) {
  const auto first = static_cast<std::int32_t>(mesh.vertices.size());
  for (const Vec3& vertex : other.vertices) mesh.vertices.push_back(vertex + shift);
  for (Triangle t : other.triangles) {
    for (std::int32_t& v : t) v += first;
    mesh.triangles.push_back(t);
  }
}

TEST(SelfIntersection, EmbeddedSurfacesHaveNone) {
  EXPECT_EQ(findSelfIntersections(icosphere(4)).pairs, 0U);
  EXPECT_EQ(findSelfIntersections(cube(6)).pairs, 0U) << "coplanar neighbours";
  EXPECT_EQ(findSelfIntersections(halfBall(8)).pairs, 0U);
  TriMesh apart = icosphere(3);
  append(apart, icosphere(3), Vec3(2.01, 0, 0));
  EXPECT_EQ(findSelfIntersections(apart).pairs, 0U);
}

TEST(SelfIntersection, OverlapsAreFoundWhateverTheirDepth) {
  for (const double distance : {1.999, 1.5, 0.3}) {
    TriMesh both = icosphere(3);
    append(both, icosphere(3), Vec3(distance, 0, 0));
    EXPECT_GT(findSelfIntersections(both).pairs, 0U) << distance;
  }
}

TEST(SelfIntersection, TouchingCounts) {
  TriMesh cubes = cube(2);
  append(cubes, cube(2), Vec3(2, 0, 0));
  EXPECT_GT(findSelfIntersections(cubes).pairs, 0U) << "faces upon faces";
  TriMesh corners = cube(2);
  append(corners, cube(2), Vec3(2, 2, 2));
  const SelfIntersections found = findSelfIntersections(corners);
  EXPECT_GT(found.pairs, 0U) << "corner on corner";
  ASSERT_TRUE(found.first);
  EXPECT_LT((*found.first)[0], (*found.first)[1]);
}

TEST(SelfIntersection, AFoldedEdgeAndAPulledVertexAreFound) {
  TriMesh mesh = icosphere(2);
  mesh.vertices[20] *= -1.2;
  EXPECT_GT(findSelfIntersections(mesh).pairs, 0U);
  // Two triangles over one edge, on the same side of it and in one plane.
  const TriMesh folded{{{0, 0, 0}, {1, 0, 0}, {0.2, 1, 0}, {0.3, 0.5, 0}}, {{0, 1, 2}, {1, 0, 3}}};
  EXPECT_EQ(findSelfIntersections(folded).pairs, 1U);
  const TriMesh flat{{{0, 0, 0}, {1, 0, 0}, {0.2, 1, 0}, {0.3, -0.5, 0}}, {{0, 1, 2}, {1, 0, 3}}};
  EXPECT_EQ(findSelfIntersections(flat).pairs, 0U);
}

TEST(SelfIntersection, AModelThatCrossesItselfIsFound) {
  POLESTAR_REQUIRE_MESHES();
  EXPECT_GT(findSelfIntersections(readMesh(*testing::meshFolder() / "castalia_selfx.off").mesh).pairs, 0U);
  EXPECT_EQ(findSelfIntersections(readMesh(*testing::meshFolder() / "castalia.obj").mesh).pairs, 0U);
}

}  // namespace
}  // namespace polestar
