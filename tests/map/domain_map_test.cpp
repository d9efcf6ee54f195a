// Solids in coordinates of a cube or polycube: exact where the solid is one itself, one to one, and the same
// after a file.
#include "polestar/map/domain_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "polestar/core/error.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/composed_map.h"
#include "polestar/map/distortion.h"
#include "polestar/map/shell_map.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/scratch_folder.h"
#include "support/solids.h"

namespace polestar::testing {
namespace {

MapOptions fieldLines() {
  MapOptions options;
  options.boundary = SphereMapKind::fieldLine;
  return options;
}

const StarShape& star() {
  static const StarShape shape = starShape(smoothStar(3));
  return shape;
}

const DomainMap& starInACube() {
  static const DomainMap map =
      mapToDomain(mapToBall(star(), fieldLines()), placePolycube(star(), cubeDomain()), fieldLines());
  return map;
}

double largestDistance(std::span<const Vec3> a, std::span<const Vec3> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double distance = (a[i] - b[i]).norm();
    if (!(distance <= largest)) largest = distance;
  }
  return largest;
}

// A polycube that lies in the world somehow: its coordinates are the similarity that put it there.
TEST(DomainMap, APolycubeIsItself) {
  const Polycube cells =
      verifyPolycube({{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 0, -1}});
  const Mat3 turn = rotationXyz({20, -35, 50});
  const Vec3 at(3, -7, 2);
  const TriMesh body =
      transformed(cells.surface(4), [&](const Vec3& p) { return Vec3(0.25 * (turn * p) + at); });
  const StarShape shape = starShape(body, at);
  PolycubeOptions options;
  options.rotation = turn;
  const PolycubeFit fit = placePolycube(shape, cells, options);
  EXPECT_GT(fit.overlap, 0.99);
  const DomainMap map = mapToDomain(mapToBall(shape, fieldLines()), fit, fieldLines());
  const std::vector<Vec3> points = pointsInside(shape, 2000);
  std::vector<Vec3> images(points.size()), expected;
  map.forward(points, images);
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    expected.push_back(fit.toDomain(points[i]));
    squares += (images[i] - expected[i]).squaredNorm();
  }
  // Two tables with different triangles; both are coarse where lines fan out from reentrant edges.
  EXPECT_LT(std::sqrt(squares / static_cast<double>(points.size())), 3e-3);
  EXPECT_LT(largestDistance(images, expected), 0.05);
}

TEST(DomainMap, TheCenterAndTheSurfaceGoWhereTheyBelong) {
  const DomainMap& map = starInACube();
  const Vec3& center = star().frame().origin;
  Vec3 image;
  map.forward({&center, 1}, {&image, 1});
  EXPECT_LT(image.norm(), 1e-12);
  const std::vector<Vec3>& vertices = star().surface().mesh().vertices;
  std::vector<Vec3> images(vertices.size());
  std::vector<double> green(vertices.size());
  map.sample(vertices, images, green);
  for (const Vec3& y : images) EXPECT_NEAR(y.lpNorm<Eigen::Infinity>(), 1, 1e-6);
}

TEST(DomainMap, OutsideTheBoundaryGoesOnAlongRays) {
  const DomainMap& map = starInACube();
  const Vec3& q = star().surface().mesh().vertices[17];
  const std::vector<Vec3> places{q, star().frame().origin + 1.3 * (q - star().frame().origin)};
  std::vector<Vec3> images(2), nowhere(2);
  std::vector<double> green(2);
  map.sample(places, images, green);
  EXPECT_LT((images[1] - 1.3 * images[0]).norm(), 1e-6);
  map.forward(places, nowhere);
  EXPECT_TRUE(nowhere[1].hasNaN());
  std::vector<Vec3> back(2);
  map.sampleInverse(images, back);
  EXPECT_LT(largestDistance(back, places), 1e-6);
}

TEST(DomainMap, ComesBackAndTurnsNothingOver) {
  const DomainMap& map = starInACube();
  const std::vector<Vec3> points = pointsInside(star(), 3000);
  std::vector<Vec3> images(points.size()), back(points.size());
  map.forward(points, images);
  map.inverse(images, back);
  EXPECT_LT(largestDistance(back, points), 1e-5);
  std::vector<Mat3> derivatives(points.size());
  map.jacobian(points, derivatives);
  EXPECT_EQ(measureDistortion(derivatives).folded, 0u);
}

TEST(DomainMap, TheJacobianIsTheDerivative) {
  const DomainMap& map = starInACube();
  constexpr double kStep = 1e-5;
  const std::vector<Vec3> points = pointsInside(star(), 200);
  std::vector<Mat3> derivatives(points.size());
  map.jacobian(points, derivatives);
  std::size_t off = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<Vec3> ahead = points, behind = points, imagesAhead(points.size()),
                      imagesBehind(points.size());
    for (Vec3& p : ahead) p[axis] += kStep;
    for (Vec3& p : behind) p[axis] -= kStep;
    map.forward(ahead, imagesAhead);
    map.forward(behind, imagesBehind);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 slope = (imagesAhead[i] - imagesBehind[i]) / (2 * kStep);
      off += !((slope - derivatives[i].col(axis)).norm() < 1e-3 * derivatives[i].norm());
    }
  }
  EXPECT_LE(off, 6u);  // of 600: where the two ends lie in different cells of a table
}

// Turned, moved and scaled: the same coordinates, when the lattice is turned along.
TEST(DomainMap, IsCarriedAlong) {
  const Mat3 turn = rotationXyz({-15, 40, 70});
  const StarShape moved = starShape(transformed(
      star().surface().mesh(), [&](const Vec3& p) { return Vec3(4 * (turn * p) + Vec3(1, 2, 3)); }));
  PolycubeOptions along, turned;
  along.rotation = Mat3::Identity();
  turned.rotation = turn;
  const DomainMap before =
      mapToDomain(mapToBall(star(), fieldLines()), placePolycube(star(), cubeDomain(), along), fieldLines());
  const DomainMap after =
      mapToDomain(mapToBall(moved, fieldLines()), placePolycube(moved, cubeDomain(), turned), fieldLines());
  const std::vector<Vec3> points = pointsInside(star(), 500);
  std::vector<Vec3> there, images(points.size()), imagesThere(points.size());
  for (const Vec3& p : points) there.push_back(4 * (turn * p) + Vec3(1, 2, 3));
  before.forward(points, images);
  after.forward(there, imagesThere);
  EXPECT_LT(largestDistance(images, imagesThere), 1e-5);
}

TEST(DomainMap, AFileHoldsAllOfIt) {
  const test::ScratchFolder folder;
  MapOptions conformal;
  const DomainMap byTable =
      mapToDomain(mapToBall(star(), conformal), placePolycube(star(), cubeDomain()), conformal);
  const std::vector<Vec3> points = pointsInside(star(), 300);
  for (const DomainMap* map : {&starInACube(), &byTable}) {
    const std::string hash = writeMapFile(folder / "map.pmap", *map, {"star.ply", "polestar map", {}});
    const MapFile file = readMapFile(folder / "map.pmap");
    ASSERT_TRUE(file.domain.has_value());
    EXPECT_EQ(file.hash, hash);
    EXPECT_EQ(file.domain->shape().cells, map->shape().cells);
    EXPECT_EQ(file.domain->shape().kind, "cube");
    EXPECT_EQ(typeid(file.domain->motion()), typeid(map->motion()));
    std::vector<Vec3> before(points.size()), after(points.size());
    map->forward(points, before);
    file.domain->forward(points, after);
    EXPECT_LT(largestDistance(before, after), 1e-12);
  }
  // A map onto the ball is written as it always was.
  writeMapFile(folder / "ball.pmap", starInACube().solid());
  EXPECT_FALSE(readMapFile(folder / "ball.pmap").domain.has_value());
}

TEST(DomainMap, AsksForAMotionThatFilesCanHold) {
  const auto chain = std::make_shared<ComposedMap>();
  EXPECT_THROW(DomainMap(starInACube().solid(), chain, starInACube().domain(), {}), Error);
}

TEST(DomainMap, GridsAreCertifiedAndAFoldIsNot) {
  const DomainMap& map = starInACube();
  const GridOptions options{.voxelSize = voxelSizeFor(star().surface().mesh(), 32)};
  SolidGrids grids = gridsOf(map, options);
  const Certificate good = certifyGrids(map, grids, 5000);
  EXPECT_EQ(good.verdict, Verdict::proved) << (good.firstFailure() ? good.firstFailure()->detail : "");
  // Two voxels in the middle change places.
  SolidGrids::Cube cube = grids.readCube("rest", {12, 12, 12}, 8);
  std::swap(cube.values[(3 * 8 + 3) * 8 + 3], cube.values[(5 * 8 + 3) * 8 + 3]);
  const std::vector<std::size_t> moved{(3 * 8 + 3) * 8 + 3, (5 * 8 + 3) * 8 + 3};
  grids.replace("rest", cube, moved);
  EXPECT_EQ(certifyGrids(map, grids, 5000).firstFailure()->name, "voxel_cells");
}

TEST(DomainMap, PositionIsTheWayBack) {
  const DomainMap& map = starInACube();
  SolidGrids grids = inverseGridsOf(map, {.voxelSize = 2.0 / 32});
  EXPECT_EQ(judgeVoxelCells(grids, "position").invertedDeep, 0u);
  const SolidGrids::Cube cube = grids.readCube("position", {10, 14, 18}, 4);
  std::vector<Vec3> places, images(cube.values.size());
  for (const Vec3f& p : cube.values) places.push_back(p.cast<double>());
  map.forward(places, images);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Vec3 index(10 + static_cast<double>(i / 16), 14 + static_cast<double>(i / 4 % 4),
                     18 + static_cast<double>(i % 4));
    EXPECT_LT((images[i] - grids.indexToWorld(index)).norm(), 1e-5);
  }
}

}  // namespace
}  // namespace polestar::testing
