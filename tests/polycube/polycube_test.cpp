#include "polestar/polycube/polycube.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "polestar/core/error.h"
#include "polestar/star/star_shape.h"
#include "random_polycube.h"
#include "support/solids.h"

namespace polestar {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// The Error that verifyPolycube() throws.
Error refusal(std::vector<Cell> cells) {
  try {
    verifyPolycube(std::move(cells));
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "accepted";
  return {Errc::usage, ""};
}

/// Corners by another way: the places where the angles around a vertex do not add up to a full turn.
std::size_t curvedVertices(const TriMesh& mesh) {
  std::vector<double> turn(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 &p = mesh.corner(t, k), a = mesh.corner(t, (k + 1) % 3) - p,
                 b = mesh.corner(t, (k + 2) % 3) - p;
      turn[mesh.triangles[t][k]] += std::atan2(a.cross(b).norm(), a.dot(b));
    }
  }
  return static_cast<std::size_t>(std::ranges::count_if(
      turn, [](double angle) { return std::abs(angle - 2 * std::numbers::pi) > 1e-6; }));
}

/// Triangles as sets of points, so that meshes of the same surface can be compared.
std::vector<std::array<std::array<double, 3>, 3>> triangleSets(const TriMesh& mesh, const Vec3& mirror) {
  std::vector<std::array<std::array<double, 3>, 3>> triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<std::array<double, 3>, 3> corners;
    for (int k = 0; k < 3; ++k) {
      const Vec3 p = mirror.cwiseProduct(mesh.corner(t, k)) + Vec3::Zero();
      corners[k] = {p[0] + 0.0, p[1] + 0.0, p[2] + 0.0};  // -0 becomes 0
    }
    std::ranges::sort(corners);
    triangles.push_back(corners);
  }
  std::ranges::sort(triangles);
  return triangles;
}

TEST(Polycube, TheCubeIsMinusOneToOne) {
  const Polycube cube = cubeDomain();
  EXPECT_EQ(cube.cellSide(), 2);
  EXPECT_EQ(cube.margin(), 0.5);
  EXPECT_EQ(cube.corners(), 8u);
  const Box box = boundingBox(cube.surface(4));
  EXPECT_EQ(box.min, Vec3(-1, -1, -1));
  EXPECT_EQ(box.max, Vec3(1, 1, 1));
}

TEST(Polycube, CornersOfKnownShapes) {
  const auto corners = [](std::vector<Cell> cells) { return verifyPolycube(std::move(cells)).corners(); };
  EXPECT_EQ(corners({{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}}), 8u);
  // The letter L, a prism over a hexagon.
  EXPECT_EQ(corners({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), 12u);
  // Three arms: seven convex corners at the ends of each but for those between two, and the one where all
  // meet.
  EXPECT_EQ(corners({{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}),
            6u * 4 + 8);
}

TEST(Polycube, EverySetThatGrewIsAStarShapedManifoldSphere) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    const Polycube polycube = testing::randomPolycube({{-3, -2, -1}, {2, 2, 3}}, 3 + 2 * seed, seed);
    const int divisions = 1 + static_cast<int>(seed % 3);
    const TriMesh mesh = polycube.surface(divisions);
    const double side = polycube.cellSide();

    const ClosedSurface surface = verifyClosedSurface(mesh);
    EXPECT_NEAR(surface.report().volume, static_cast<double>(polycube.cells().size()) * side * side * side,
                1e-12);
    EXPECT_NEAR(boundingBox(mesh).extent().maxCoeff(), 2, 1e-15);
    EXPECT_EQ(curvedVertices(mesh), polycube.corners());

    const StarShape shape = testing::starShape(mesh, Vec3::Zero());
    EXPECT_NEAR(shape.report().centerMargin, polycube.margin() * side, 1e-14);
  }
}

TEST(Polycube, MirroredCellsHaveMirroredTriangles) {
  for (const Vec3& mirror : {Vec3(-1, 1, 1), Vec3(1, -1, 1), Vec3(1, 1, -1)}) {
    const Polycube polycube = testing::randomPolycube({{-2, -1, -2}, {1, 3, 2}}, 25, 7);
    std::vector<Cell> mirrored(polycube.cells().begin(), polycube.cells().end());
    for (Cell& cell : mirrored) {
      for (int k = 0; k < 3; ++k) cell[k] *= static_cast<int>(mirror[k]);
    }
    EXPECT_EQ(triangleSets(polycube.surface(2), mirror),
              triangleSets(verifyPolycube(mirrored).surface(2), Vec3::Ones()));
  }
}

TEST(Polycube, NoTriangleHasTwoEdgesOnCreases) {
  // Such a triangle has its three vertices on creases, and no field line between them but at its corners.
  const TriMesh mesh = cubeDomain().surface(2);
  const auto creases = [](const Vec3& p) { return (p.array().abs() == 1).count() >= 2; };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    EXPECT_FALSE(creases(mesh.corner(t, 0)) && creases(mesh.corner(t, 1)) && creases(mesh.corner(t, 2)));
}

TEST(Polycube, WhatIsNotStarShapedIsNamed) {
  const Error gap = refusal({{0, 0, 0}, {2, 0, 0}});
  EXPECT_EQ(gap.code(), Errc::notStarShaped);
  EXPECT_THAT(gap.what(), HasSubstr("2 0 0 needs 1 0 0"));
  // One cell, two gaps: beside the axes both neighbours are needed.
  EXPECT_THAT(
      refusal({{0, 0, 0}, {-1, -1, 0}}).what(),
      AllOf(HasSubstr("-1 -1 0 needs 0 -1 0"), HasSubstr("-1 -1 0 needs -1 0 0"), Not(HasSubstr("more"))));
  EXPECT_THAT(refusal({{0, 0, 0}, {5, 5, 5}, {3, 3, 3}}).what(), HasSubstr("and 3 more"));

  const Error empty = refusal({});
  EXPECT_EQ(empty.code(), Errc::notStarShaped);
  EXPECT_THAT(empty.what(), HasSubstr("no cell"));
  const Error centerless = refusal({{1, 0, 0}, {2, 0, 0}});
  EXPECT_EQ(centerless.code(), Errc::notStarShaped);
  EXPECT_THAT(centerless.what(), HasSubstr("cell 0 0 0"));
}

TEST(Polycube, ImpossibleListsAreRefused) {
  const Error twice = refusal({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}});
  EXPECT_EQ(twice.code(), Errc::usage);
  EXPECT_THAT(twice.what(), HasSubstr("0 0 0 is listed twice"));
  std::vector<Cell> far;
  for (int i = 0; i <= Polycube::kLargestIndex + 1; ++i) far.push_back({i, 0, 0});
  const Error beyond = refusal(far);
  EXPECT_EQ(beyond.code(), Errc::usage);
  EXPECT_THAT(beyond.what(), HasSubstr("65 0 0"));
  EXPECT_THROW(cubeDomain().surface(0), Error);
  EXPECT_THROW(cubeDomain().surface(100000), Error);
}

}  // namespace
}  // namespace polestar
