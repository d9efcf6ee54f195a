#include "polestar/mesh/bisect.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

double smallestAngle(const TriMesh& mesh) {
  double smallest = 10;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 u = mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k),
                 v = mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k);
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

TEST(BisectLongestEdges, DoesNotDependOnTheOrderOfVertices) {
  // Full of isosceles and equilateral triangles.
  const TriMesh mesh = icosphere(2);
  const std::size_t n = mesh.vertices.size();
  const Mat3 turn = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  TriMesh other;
  for (std::size_t i = 0; i < n; ++i) other.vertices.push_back(turn * mesh.vertices[(7 * i + 3) % n]);
  std::vector<std::int32_t> newId(n);
  for (std::size_t i = 0; i < n; ++i) newId[(7 * i + 3) % n] = static_cast<std::int32_t>(i);
  std::vector<char> marked, otherMarked;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& c = mesh.triangles[t];
    other.triangles.push_back({newId[c[1]], newId[c[2]], newId[c[0]]});
    marked.push_back(t % 5 == 0);
  }
  otherMarked = marked;
  auto centroids = [](const TriMesh& m, const Mat3& back) {
    std::vector<std::array<long, 3>> list;
    for (std::size_t t = 0; t < m.triangles.size(); ++t) {
      const Vec3 c = 1e6 * (back * (m.corner(t, 0) + m.corner(t, 1) + m.corner(t, 2)));
      list.push_back({std::lround(c[0] / 10), std::lround(c[1] / 10), std::lround(c[2] / 10)});
    }
    std::sort(list.begin(), list.end());
    return list;
  };
  EXPECT_EQ(centroids(bisectLongestEdges(mesh, marked).mesh, Mat3::Identity()),
            centroids(bisectLongestEdges(other, otherMarked).mesh, turn.transpose()));
}

}  // namespace
}  // namespace polestar
