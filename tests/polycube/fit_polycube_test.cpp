#include "polestar/polycube/fit_polycube.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <string>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "random_polycube.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::starShape;

Mat3 turn(double degrees, const Vec3& axis) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized()).toRotationMatrix();
}

TriMesh moved(const TriMesh& mesh, const Mat3& rotation, double scale, const Vec3& offset) {
  return transformed(mesh, [&](const Vec3& v) { return Vec3(scale * (rotation * v) + offset); });
}

/// Degrees between two lattices: the least angle over the 24 ways to name the axes of one.
double angleBetweenLattices(const Mat3& a, const Mat3& b) {
  double largestTrace = -1;
  const Mat3 relative = a.transpose() * b;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 named = Mat3::Zero();
      for (int k = 0; k < 3; ++k) named(order[k], k) = signs >> k & 1 ? -1 : 1;
      if (named.determinant() > 0) largestTrace = std::max(largestTrace, (relative * named).trace());
    }
  } while (std::ranges::next_permutation(order).found);
  return std::acos(std::clamp((largestTrace - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi;
}

/// Cells in the mesh's frame rather than the lattice's: their middles, sorted.
std::vector<std::array<long, 3>> placedMiddles(const PolycubeFit& fit, const Mat3& frame) {
  std::vector<std::array<long, 3>> middles;
  for (const Cell& cell : fit.polycube.cells()) {
    const Vec3 middle = frame.transpose() * fit.axes * Vec3(cell[0], cell[1], cell[2]);
    middles.push_back({std::lround(middle[0]), std::lround(middle[1]), std::lround(middle[2])});
  }
  std::ranges::sort(middles);
  return middles;
}

TEST(FitPolycube, ACubeIsOneCell) {
  for (const int cells : {1, 5}) {
    const PolycubeFit fit = fitPolycube(starShape(moved(cube(4), Mat3::Identity(), 3, {7, 8, 9})),
                                        {.cells = cells, .rotations = 8});
    EXPECT_NEAR(fit.overlap, 1, 1e-9);
    EXPECT_EQ(fit.axes, Mat3(Mat3::Identity()));
    EXPECT_NEAR((fit.center - Vec3(7, 8, 9)).norm(), 0, 1e-6);
    EXPECT_NEAR(fit.unit, 3, 1e-6);
  }
}

TEST(FitPolycube, ABallInItsBestCube) {
  // Unit ball and cube of half side a: the overlap is known in closed form as long as edges stay outside.
  const double ball = 4 * std::numbers::pi / 3;
  double best = 0, bestHalf = 0;
  for (double a = 0.7072; a < 1; a += 1e-5) {
    const double shared = ball - 2 * std::numbers::pi * (1 - a) * (1 - a) * (2 + a);  // six caps
    const double overlap = shared / (8 * a * a * a + ball - shared);
    if (overlap > best) best = overlap, bestHalf = a;
  }
  const StarShape shape = starShape(icosphere(5), Vec3::Zero());
  const PolycubeFit placed = placePolycube(shape, cubeDomain(), {.rotation = Mat3::Identity()});
  EXPECT_NEAR(placed.overlap, best, 2e-3);
  EXPECT_NEAR(placed.unit, bestHalf, 5e-3);
  const PolycubeFit fitted = fitPolycube(shape, {.cells = 1, .rotation = Mat3::Identity()});
  EXPECT_NEAR(fitted.overlap, placed.overlap, 1e-6);
  EXPECT_EQ(fitted.polycube, cubeDomain());
}

TEST(FitPolycube, FindsPolycubesAgain) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const Polycube polycube = testing::randomPolycube({{-3, -2, -1}, {2, 2, 3}}, 40, seed);
    const Mat3 axes = turn(15 + 10 * seed, {1, 2.0 * seed, -1});
    const StarShape shape = starShape(moved(polycube.surface(2), axes, 5, {1, 2, 3}), Vec3(1, 2, 3));
    const PolycubeFit fit = fitPolycube(shape, {.cells = polycube.longestSide(), .rotation = axes});
    EXPECT_EQ(fit.polycube, polycube);
    EXPECT_NEAR(fit.overlap, 1, 1e-6);
    EXPECT_NEAR(fit.unit, 5, 1e-3);
    EXPECT_NEAR((fit.toDomain(fit.toWorld({0.3, -0.2, 0.5})) - Vec3(0.3, -0.2, 0.5)).norm(), 0, 1e-14);
    const Vec3 vertex = polycube.surface(2).vertices[5];
    EXPECT_NEAR((fit.toDomain(shape.surface().mesh().vertices[5]) - vertex).norm(), 0, 1e-3);
  }
}

TEST(FitPolycube, FindsTheLatticeOfTurnedPolycubes) {
  const Polycube polycube = testing::randomPolycube({{-3, -1, -1}, {2, 1, 2}}, 30, 9);
  std::vector<std::array<long, 3>> middles;
  for (const Cell& cell : polycube.cells()) middles.push_back({cell[0], cell[1], cell[2]});
  for (const double degrees : {20.0, 100.0}) {
    SCOPED_TRACE(degrees);
    const Mat3 axes = turn(degrees, {1, -2, 0.5});
    const StarShape shape = starShape(moved(polycube.surface(2), axes, 1, {0, 0, 0}), Vec3::Zero());
    const PolycubeFit fit = fitPolycube(shape, {.cells = polycube.longestSide()});
    EXPECT_LT(angleBetweenLattices(fit.axes, axes), 1);
    EXPECT_GT(fit.overlap, 0.97);
    EXPECT_EQ(placedMiddles(fit, axes), middles);

    const PolycubeFit placed = placePolycube(shape, polycube);
    EXPECT_GT(placed.overlap, 0.97);
    // This one has no symmetry: its position is the one it was made in.
    EXPECT_LT((placed.axes - axes).norm(), 0.03);
    EXPECT_NEAR(placed.unit, 1, 0.02);
  }
}

TEST(FitPolycube, ATurnedSolidGetsTheTurnedPolycube) {
  // 9 x 5 x 3 cells, the center in the middle of one of them: no other lattice overlaps fully.
  const Vec3 center(1, 0, 0);
  const TriMesh brick =
      transformed(cube(6), [](const Vec3& v) { return Vec3(4.5 * v[0], 2.5 * v[1], 1.5 * v[2]); });
  const PolycubeFit straight = fitPolycube(starShape(brick, center), {.cells = 9});
  EXPECT_EQ(straight.axes, Mat3(Mat3::Identity()));
  EXPECT_GT(straight.overlap, 0.99);
  for (const Mat3& rotation : {turn(30, {1, 1, 0.2})}) {
    const PolycubeFit turned =
        fitPolycube(starShape(moved(brick, rotation, 1, {0, 0, 0}), rotation * center), {.cells = 9});
    EXPECT_LT(angleBetweenLattices(turned.axes, rotation), 1);
    EXPECT_NEAR(turned.overlap, straight.overlap, 0.01);
    EXPECT_EQ(placedMiddles(turned, rotation), placedMiddles(straight, Mat3::Identity()));
  }
}

TEST(FitPolycube, StaysWithinTheCellsAskedFor) {
  const StarShape shape = starShape(asteroid(12));
  double before = 0;
  for (const int cells : {1, 2, 3, 4, 7, 12, 24}) {
    const PolycubeFit fit = fitPolycube(shape, {.cells = cells, .rotation = Mat3::Identity()});
    EXPECT_LE(fit.polycube.longestSide(), cells);
    EXPECT_GT(fit.overlap, before - 0.01);
    before = fit.overlap;
  }
  EXPECT_GT(before, 0.9);
}

TEST(FitPolycube, FewerCornersWithTheOverlapAskedFor) {
  const StarShape shape = starShape(stylizedHead(16));
  const PolycubeFit full = fitPolycube(shape, {.cells = 12, .rotation = Mat3::Identity()});
  const PolycubeFit simple =
      fitPolycube(shape, {.cells = 12, .rotation = Mat3::Identity(), .overlap = full.overlap - 0.05});
  EXPECT_GE(simple.overlap, full.overlap - 0.05);
  EXPECT_LT(2 * simple.polycube.corners(), full.polycube.corners());
  // A polycube is found to be as simple as it is.
  const StarShape bar =
      starShape(verifyPolycube({{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).surface(4), Vec3::Zero());
  const PolycubeFit found = fitPolycube(bar, {.cells = 12, .rotation = Mat3::Identity(), .overlap = 0.95});
  EXPECT_EQ(found.polycube.corners(), 16u);
}

TEST(FitPolycube, AnOverlapOutOfReachIsTold) {
  Context context;
  std::string warning;
  context.onLog = [&](LogLevel level, std::string_view message) {
    if (level == LogLevel::warning) warning += message;
  };
  const StarShape ball = starShape(icosphere(3), Vec3::Zero());
  const PolycubeFit fit =
      fitPolycube(ball, {.cells = 3, .rotation = Mat3::Identity(), .overlap = 0.99}, context);
  EXPECT_LT(fit.overlap, 0.99);
  EXPECT_THAT(warning, ::testing::HasSubstr("none of up to 3 cells"));
}

TEST(FitPolycube, TheSameForAnyNumberOfThreads) {
  const StarShape shape = starShape(asteroid(10));
  std::vector<PolycubeFit> fits;
  for (const int threads : {1, 2}) {
    withThreads(threads, [&] { fits.push_back(fitPolycube(shape, {.cells = 6, .rotations = 12})); });
  }
  EXPECT_EQ(fits[0].polycube, fits[1].polycube);
  EXPECT_EQ(fits[0].axes, fits[1].axes);
  EXPECT_EQ(fits[0].unit, fits[1].unit);
  EXPECT_EQ(fits[0].overlap, fits[1].overlap);
}

TEST(FitPolycube, ImpossibleOptionsAreRefused) {
  const StarShape ball = starShape(icosphere(2), Vec3::Zero());
  for (const PolycubeOptions& options :
       {PolycubeOptions{.cells = 0}, PolycubeOptions{.cells = 65}, PolycubeOptions{.rotations = -1},
        PolycubeOptions{.overlap = 1.0}, PolycubeOptions{.rotation = Mat3(2 * Mat3::Identity())},
        PolycubeOptions{.rotation = Mat3(-Mat3::Identity())}}) {
    try {
      fitPolycube(ball, options);
      ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage);
    }
  }
}

TEST(FitPolycubeToRealModels, OverlapsWell) {
  POLESTAR_REQUIRE_MESHES();
  for (const std::string& name :
       testing::chosenModels({"castalia.obj", "max_smooth100.off", "cat_head_capped.ply"},
                             {"bennu.ply", "phobos.off", "golevka.stl"})) {
    SCOPED_TRACE(name);
    const PolycubeFit fit =
        fitPolycube(testing::starShapeFromFile(*testing::meshFolder() / name), {.cells = 16});
    EXPECT_GE(fit.overlap, 0.84);
    EXPECT_LE(fit.polycube.longestSide(), 16);
    const StarShape domain = testing::starShape(fit.polycube.surface(2), Vec3::Zero());
    EXPECT_NEAR(domain.report().centerMargin, fit.polycube.margin() * fit.polycube.cellSide(), 1e-12);
  }
}

}  // namespace
}  // namespace polestar
