#include "polestar/green/detail/bisect.h"

#include <gtest/gtest.h>

#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

double smallestAngle(const TriMesh& mesh) {
  double smallest = 10;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 u = mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k), v = mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k);
      smallest = std::min(smallest, std::atan2(u.cross(v).norm(), u.dot(v)));
    }
  }
  return smallest;
}

TEST(BisectLongestEdges, StaysAClosedSurfaceOfTheSameShape) {
  TriMesh mesh = smoothStar(2);
  const double volume = volumeProperties(mesh).volume, area = surfaceArea(mesh), angle = smallestAngle(mesh);
  for (int round = 0; round < 5; ++round) {
    std::vector<char> marked(mesh.triangles.size(), 0);
    for (std::size_t t = 0; t < marked.size(); t += 7) marked[t] = 1;
    const Refinement refined = bisectLongestEdges(mesh, marked);
    EXPECT_EQ(refined.coarseVertices, mesh.vertices.size());
    ASSERT_EQ(refined.parents.size(), refined.mesh.vertices.size() - mesh.vertices.size());
    EXPECT_GE(refined.mesh.triangles.size(), mesh.triangles.size() + mesh.triangles.size() / 7);
    mesh = refined.mesh;
    EXPECT_TRUE(inspectSurface(mesh).valid) << inspectSurface(mesh).defect;
    EXPECT_NEAR(volumeProperties(mesh).volume, volume, 1e-12);
    EXPECT_NEAR(surfaceArea(mesh), area, 1e-11);
  }
  // Rivara: never below half the smallest angle one started from.
  EXPECT_GE(smallestAngle(mesh), 0.5 * angle);
}

TEST(BisectLongestEdges, NothingMarkedNothingChanged) {
  const TriMesh mesh = cube(3);
  const Refinement refined = bisectLongestEdges(mesh, std::vector<char>(mesh.triangles.size(), 0));
  EXPECT_EQ(refined.mesh.triangles, mesh.triangles);
  EXPECT_EQ(refined.mesh.vertices.size(), mesh.vertices.size());
}

}  // namespace
}  // namespace polestar::detail
