#include "polestar/sphere/detail/sphere_quality.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "polestar/mesh/shapes.h"
#include "polestar/sphere/dilatation.h"
#include "polestar/sphere/sphere_map.h"
#include "support.h"

namespace polestar {
namespace {

using testing::someRotation;

TEST(CountFlips, NoneOnASphereAllOnItsMirrorImage) {
  TriMesh mesh = icosphere(3);
  EXPECT_EQ(countFlips(mesh.vertices, mesh.triangles), 0u);
  for (Vec3& v : mesh.vertices) v[1] = -v[1];
  EXPECT_EQ(countFlips(mesh.vertices, mesh.triangles), mesh.triangles.size());
}

TEST(CountFlips, SeesAFold) {
  // A vertex pulled across the far side of its ring turns over triangles of its own and no others.
  TriMesh mesh = icosphere(3);
  const std::int32_t v = 100;
  Vec3 far = mesh.vertices[v];
  std::size_t around = 0;
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] == v) ++around, far = mesh.vertices[t[(k + 1) % 3]];
    }
  }
  std::vector<Vec3> directions = mesh.vertices;
  directions[v] = (mesh.vertices[v] + 1.5 * (far - mesh.vertices[v])).normalized();
  const auto flipped = detail::flippedTriangles(directions, mesh.triangles);
  EXPECT_EQ(flipped.size(), countFlips(directions, mesh.triangles));
  EXPECT_GT(flipped.size(), 0u);
  EXPECT_LE(flipped.size(), around);
  for (const std::int32_t t : flipped) {
    const Triangle& corners = mesh.triangles[t];
    EXPECT_TRUE(corners[0] == v || corners[1] == v || corners[2] == v);
  }
}

TEST(CountFlips, ATriangleThatCollapsedIsAFlip) {
  const TriMesh mesh = icosphere(1);
  std::vector<Vec3> directions = mesh.vertices;
  directions[mesh.triangles[0][0]] = directions[mesh.triangles[0][1]];
  EXPECT_GE(countFlips(directions, mesh.triangles), 2u);  // the two triangles at the collapsed edge
}

TEST(Dilatation, OfLinearMaps) {
  const std::array<Vec3, 3> from{Vec3(0.1, 0.2, 0), Vec3(1.3, 0.4, 0), Vec3(0.5, 1.1, 0)};
  auto image = [&](const Mat3& map) {
    return std::array<Vec3, 3>{map * from[0], map * from[1], map * from[2]};
  };
  EXPECT_NEAR(dilatation(from, from), 1, 1e-15);
  EXPECT_NEAR(dilatation(from, image(1e-5 * someRotation())), 1, 1e-14);
  EXPECT_NEAR(dilatation(from, image(someRotation() * Vec3(6, 2, 1).asDiagonal())), 3, 1e-14);
  EXPECT_NEAR(dilatation(from, image(Vec3(2, 7, 1).asDiagonal())), 3.5, 1e-14);
  Mat3 shear = Mat3::Identity();
  shear(0, 1) = 1;  // singular values (sqrt(5) +- 1) / 2
  EXPECT_NEAR(dilatation(from, image(shear)), (3 + std::sqrt(5.0)) / 2, 1e-14);
  EXPECT_NEAR(dilatation(from, image(Vec3(1, 1e-9, 1).asDiagonal())) * 1e-9, 1, 1e-6);
  EXPECT_TRUE(std::isinf(dilatation(from, image(Vec3(1, 0, 1).asDiagonal()))));
}

TEST(AngleDistortion, IsWeightedByTheSurface) {
  // Two triangles on a doubled square, of areas 1 and 3; only the first is stretched, by 2.
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, 0, 1}, {3, 0, 1}, {0, 2, 1}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  std::vector<Vec3> image = mesh.vertices;
  image[1][0] = 1;
  const detail::Distortion distortion = detail::angleDistortion(mesh, image);
  EXPECT_NEAR(distortion.mean, (1 * 2 + 3 * 1) / 4.0, 1e-14);
  EXPECT_NEAR(distortion.max, 2, 1e-14);
}

TEST(BestRotation, FindsTheRotation) {
  const TriMesh mesh = icosphere(1);
  const std::vector<double> weight(mesh.vertices.size(), 0.3);
  const auto to = testing::rotated(someRotation(), mesh.vertices);
  EXPECT_LT((bestRotation(mesh.vertices, to, weight) - someRotation()).norm(), 1e-14);
}

TEST(BestRotation, HeedsTheWeights) {
  const std::vector<Vec3> from{Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitX()};
  const std::vector<Vec3> to{Vec3::UnitY(), -Vec3::UnitX(), Vec3::UnitZ()};
  const Mat3 turn = bestRotation(from, to, std::vector<double>{1, 1, 0});
  EXPECT_LT((turn * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-14);
  EXPECT_LT((turn * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-14);
}

TEST(BestRotation, IsProperForMirrorsLinesAndNothing) {
  const TriMesh mesh = icosphere(1);
  std::vector<double> weight(mesh.vertices.size(), 1.0);
  std::vector<Vec3> mirrored = mesh.vertices;
  for (Vec3& v : mirrored) v = -v;
  const std::vector<Vec3> line(mesh.vertices.size(), Vec3::UnitZ());
  for (const auto& to : {mirrored, line}) {
    const Mat3 turn = bestRotation(mesh.vertices, to, weight);
    EXPECT_NEAR(turn.determinant(), 1, 1e-12);
    EXPECT_LT((turn * turn.transpose() - Mat3::Identity()).norm(), 1e-12);
  }
  weight.assign(weight.size(), 0.0);
  EXPECT_NEAR(bestRotation(mesh.vertices, mesh.vertices, weight).determinant(), 1, 1e-12);
}

}  // namespace
}  // namespace polestar
