// Embree's count where the answer is known, above all for rays that hit edges and vertices.

#include "polestar/star/detail/ray_count.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "polestar/mesh/shapes.h"
#include "polestar/star/detail/exact_verdict.h"
#include "star/bodies.h"

namespace polestar::detail {
namespace {

TriMesh about(const TriMesh& mesh, const Vec3& center) {
  return judgeCenter(mesh, center, 4, Context::quiet()).mesh;
}

void expectOneCrossingThroughEveryVertexAndEdge(const TriMesh& mesh) {
  const RayCount vertices = countRayHits(
      mesh, mesh.vertices.size(), [&](std::size_t i) { return mesh.vertices[i]; }, Context::quiet());
  EXPECT_EQ(vertices.count, mesh.vertices.size());
  EXPECT_EQ(vertices.failed, 0u);
  const RayCount edges = countRayHits(
      mesh, 3 * mesh.triangles.size(),
      [&](std::size_t i) { return Vec3(mesh.corner(i / 3, i % 3) + mesh.corner(i / 3, (i + 1) % 3)); },
      Context::quiet());
  EXPECT_EQ(edges.failed, 0u);
}

TEST(RayCount, EdgesAndVerticesCountOnce) {
  expectOneCrossingThroughEveryVertexAndEdge(about(cube(10), Vec3::Zero()));
  expectOneCrossingThroughEveryVertexAndEdge(about(cube(10), Vec3(0.3, 0.9, -0.2)));
  expectOneCrossingThroughEveryVertexAndEdge(about(icosphere(4), Vec3::Zero()));
  expectOneCrossingThroughEveryVertexAndEdge(about(halfBall(16), Vec3(0, 0, 0.05)));
  expectOneCrossingThroughEveryVertexAndEdge(about(testing::stellaOctangula(), Vec3(0.2, 0.3, 0.4)));
}

TEST(RayCount, StarShapesHaveNoFailures) {
  for (const TriMesh& mesh : {about(cube(10), Vec3::Zero()), about(icosphere(4), Vec3(0.5, 0.5, 0.5)),
                              about(halfBall(16), Vec3(0, 0, 0.4)), about(smoothStar(5), Vec3::Zero())}) {
    const RayCount rays = countRayHits(mesh, 20000, Context::quiet());
    EXPECT_EQ(rays.count, mesh.triangles.size() + 20000);
    EXPECT_EQ(rays.failed, 0u);
  }
}

TEST(RayCount, HiddenSurfaceShows) {
  // From the foot of the U a part of each arm is behind the slot.
  const RayCount u =
      countRayHits(about(testing::letterU().mesh, Vec3(0.2, 0.2, 0.5)), 20000, Context::quiet());
  EXPECT_GT(u.failed, 200u);
  // From outside every ray hits twice or not at all.
  const RayCount outside = countRayHits(about(cube(4), Vec3(3, 0.1, 0.2)), 20000, Context::quiet());
  EXPECT_EQ(outside.failed, outside.count);
  const RayCount twice = countRayHits(about(testing::twiceAround(), Vec3::Zero()), 20000, Context::quiet());
  EXPECT_GT(twice.failed, twice.count * 99 / 100);
}

// Crossings of the ray from the origin with all faces, in doubles; random directions meet no edge.
int crossings(const TriMesh& mesh, const Vec3& direction) {
  int count = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    Mat3 corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = mesh.corner(f, k);
    const Vec3 share = corners.inverse() * direction;
    count += (share.array() > 0).all();
  }
  return count;
}

TEST(RayCount, FailuresHaveTheirShareOfTheSphere) {
  const TriMesh mesh = about(testing::letterU().mesh, Vec3(0.2, 0.2, 0.5));
  std::mt19937 engine(1);
  std::normal_distribution<> normal;
  constexpr int kTrials = 100000;
  double expected = 0;
  for (int i = 0; i < kTrials; ++i) {
    expected += crossings(mesh, Vec3(normal(engine), normal(engine), normal(engine))) != 1;
  }
  expected /= kTrials;
  const double all = static_cast<double>(countRayHits(mesh, kTrials, Context::quiet()).failed);
  const double throughFaces = static_cast<double>(countRayHits(mesh, 0, Context::quiet()).failed);
  EXPECT_GT(expected, 0.01);
  EXPECT_NEAR((all - throughFaces) / kTrials, expected, 4 * std::sqrt(expected / kTrials));
}

}  // namespace
}  // namespace polestar::detail
