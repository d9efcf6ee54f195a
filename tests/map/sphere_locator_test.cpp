#include "polestar/sphere/sphere_locator.h"

#include <gtest/gtest.h>

#include <random>

#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

TEST(SphereLocator, FindsEveryDirectionOfAStarShape) {
  const TriMesh mesh = smoothStar(3);
  const SphereLocator locator(mesh.vertices, mesh.triangles);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 u = Vec3(normal(random), normal(random), normal(random)).normalized();
    const auto hit = locator.locate(7 * u);
    ASSERT_TRUE(hit);
    EXPECT_GE(hit->weights.minCoeff(), -1e-9);
    EXPECT_NEAR(hit->weights.sum(), 1, 1e-12);
    EXPECT_LT(locator.point(*hit).normalized().cross(u).norm(), 1e-12);
  }
}

TEST(SphereLocator, FindsVerticesAndEdgesAndLargeTriangles) {
  const TriMesh mesh = icosphere(0);
  const SphereLocator locator(mesh.vertices, mesh.triangles);
  for (const Vec3& v : mesh.vertices) EXPECT_TRUE(locator.locate(v));
  for (const Triangle& t : mesh.triangles) {
    EXPECT_TRUE(locator.locate(mesh.vertices[t[0]] + mesh.vertices[t[1]]));
    const auto hit = locator.locate(mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]);
    ASSERT_TRUE(hit);
    EXPECT_EQ(mesh.triangles[hit->triangle], t);
  }
}

TEST(SphereLocator, SaysWhereNothingIs) {
  const TriMesh mesh = icosphere(1);
  std::vector<Triangle> open(mesh.triangles.begin() + 1, mesh.triangles.end());
  const Triangle& missing = mesh.triangles[0];
  const SphereLocator locator(mesh.vertices, open);
  EXPECT_FALSE(
      locator.locate(mesh.vertices[missing[0]] + mesh.vertices[missing[1]] + mesh.vertices[missing[2]]));
}

}  // namespace
}  // namespace polestar
