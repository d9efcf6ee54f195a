// The report on tetrahedra, on moves whose outcome is known.
#include "polestar/mesh/tet_orientation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mesh/tet_bodies.h"
#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<Vec3> moved(const std::vector<Vec3>& points, const auto& move) {
  std::vector<Vec3> result;
  for (const Vec3& p : points) result.push_back(move(p));
  return result;
}

TEST(TetOrientation, NothingTurnsUnderAStretchedTurn) {
  const TetMesh mesh = testing::shells(icosphere(2), 3);
  const auto tetrahedra = mesh.tetrahedra();
  Mat3 stretch;
  stretch << 0, -3, 0, 1, 0.5, 0, 0, 0, 2;
  const TetReport report = compareTetrahedra(
      tetrahedra.corners, mesh.vertices,
      moved(mesh.vertices, [&](const Vec3& p) { return Vec3(stretch * p + Vec3(7, 8, 9)); }));
  EXPECT_EQ(report.tetrahedra, 320u * 7);
  EXPECT_EQ(report.before.positive, report.tetrahedra);
  EXPECT_EQ(report.after.positive, report.tetrahedra);
  EXPECT_TRUE(report.good());
  EXPECT_THAT(report.bad, IsEmpty());
  EXPECT_EQ(report.onBoundary, 0u);
  EXPECT_GT(report.qualityBefore.least, 0);
  EXPECT_LE(report.qualityBefore.least, report.qualityBefore.onePercent);
  EXPECT_LE(report.qualityBefore.onePercent, report.qualityBefore.mean);
  EXPECT_LT(report.qualityAfter.mean, report.qualityBefore.mean);
}

TEST(TetOrientation, AMirroredFileIsJudgedByWhatChanges) {
  const TetMesh mesh = testing::shells(icosphere(1), 2);
  auto tetrahedra = mesh.tetrahedra().corners;
  for (Tetrahedron& t : tetrahedra) std::swap(t[0], t[1]);
  const TetReport same = compareTetrahedra(tetrahedra, mesh.vertices, mesh.vertices);
  EXPECT_EQ(same.before.negative, same.tetrahedra);
  EXPECT_TRUE(same.good());
  const TetReport mirrored = compareTetrahedra(tetrahedra, mesh.vertices,
                                               moved(mesh.vertices, [](const Vec3& p) { return Vec3(-p); }));
  EXPECT_EQ(mirrored.turned, mirrored.tetrahedra);
  EXPECT_EQ(mirrored.bad.size(), mirrored.tetrahedra);
  EXPECT_LT(mirrored.qualityAfter.mean, 0);
}

// The control that must fail: x -> x^2 folds the body in half.
TEST(TetOrientation, FindsEveryTetrahedronOfAFold) {
  const TetMesh mesh = testing::shells(icosphere(2), 3);
  const auto tetrahedra = mesh.tetrahedra().corners;
  const TetReport report =
      compareTetrahedra(tetrahedra, mesh.vertices, moved(mesh.vertices, [](const Vec3& p) {
                          return Vec3(p.x() * p.x() + 2 * std::max(0.0, p.x()), p.y(), p.z());
                        }));
  EXPECT_FALSE(report.good());
  std::size_t left = 0;
  for (const Tetrahedron& t : tetrahedra) {
    left += std::all_of(t.begin(), t.end(), [&](std::int32_t v) { return mesh.vertices[v].x() < -1e-9; });
  }
  EXPECT_GE(report.turned, left);
  EXPECT_LT(report.turned, report.tetrahedra * 6 / 10);
  EXPECT_LT(report.qualityAfter.least, 0);
}

TEST(TetOrientation, CountsFlatOnesApartAndThoseOnTheBoundary) {
  // Two tetrahedra that share a face: all vertices lie on the boundary.
  const std::vector<Vec3> before{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}};
  const std::vector<Tetrahedron> tetrahedra{{0, 1, 2, 3}, {0, 2, 1, 4}};
  std::vector<Vec3> after = before;
  after[3].z() = 0;
  after[4].z() = 1e-300;
  const TetReport report = compareTetrahedra(tetrahedra, before, after);
  EXPECT_EQ(report.onBoundary, 2u);
  EXPECT_EQ(report.flattened, 1u);
  EXPECT_EQ(report.flattenedOnBoundary, 1u);
  EXPECT_EQ(report.turned, 1u);
  EXPECT_EQ(report.turnedOnBoundary, 1u);
  EXPECT_EQ(report.after.flat, 1u);
  EXPECT_THAT(report.bad, ElementsAre(0, 1));
}

TEST(TetOrientation, BoundaryVerticesAreThoseOfOpenFaces) {
  const TetMesh mesh = testing::shells(icosphere(1), 3);
  const std::vector<char> boundary = boundaryVertices(mesh.tetrahedra().corners, mesh.vertices.size());
  const std::size_t outer = icosphere(1).vertices.size();
  for (std::size_t i = 0; i < boundary.size(); ++i) EXPECT_EQ(boundary[i] != 0, i < outer) << i;
}

TEST(TetOrientation, MeanRatioOfARegularTetrahedronIsOne) {
  const Vec3 a(1, 1, 1), b(1, -1, -1), c(-1, 1, -1), d(-1, -1, 1);
  EXPECT_NEAR(meanRatio(a, b, c, d), 1, 1e-14);
  EXPECT_NEAR(meanRatio(1e-7 * a, 1e-7 * c, 1e-7 * b, 1e-7 * d), 1, 1e-14);
  EXPECT_EQ(meanRatio(a, b, c, c), 0);
  EXPECT_EQ(meanRatio(a, a, a, a), 0);
  // Verified by hand: three unit edges at right angles: 12 (1/2)^(2/3) / 9.
  EXPECT_NEAR(meanRatio(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()),
              12 * std::pow(0.5, 2.0 / 3) / 9, 1e-14);
}

TEST(TetOrientation, NoTetrahedraNoTrouble) {
  const TetReport report = compareTetrahedra({}, {}, {});
  EXPECT_EQ(report.tetrahedra, 0u);
  EXPECT_TRUE(report.good());
}

}  // namespace
}  // namespace polestar
