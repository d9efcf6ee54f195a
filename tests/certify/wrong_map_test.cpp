// Maps that are none, each spoiled in one way: the check that is there for it refuses it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "certify/maps.h"
#include "polestar/core/covering_number.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/solids.h"

namespace polestar {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using testing::failureOf;
using testing::failuresOf;
using ::testing::IsEmpty;
using testing::mapOf;
using testing::partsOf;
using testing::star;

const std::vector<Triangle>& triangles() { return star().chart().foliation().triangles; }

std::vector<std::string> failures(const BallMap& map) { return failuresOf(certify(map, {}, {}, 1)); }

BallMap withDirections(std::vector<Vec3> directions) {
  return {star().chart(), testing::sphereMap(star().chart(), std::move(directions))};
}

std::vector<Vec3> moved(const std::function<Vec3(const Vec3&)>& move) {
  std::vector<Vec3> directions = star().sphere().directions;
  for (Vec3& u : directions) u = move(u).normalized();
  return directions;
}

// --- phi -------------------------------------------------------------------------------------------------

TEST(WrongPhi, TurnedAsAWholeIsNotWrong) {
  const Mat3 turn = Eigen::AngleAxisd(2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  EXPECT_THAT(failures(withDirections(moved([&](const Vec3& u) { return Vec3(turn * u); }))), IsEmpty());
}

TEST(WrongPhi, Mirrored) {
  const BallMap map = withDirections(moved([](const Vec3& u) { return Vec3(-u[0], u[1], u[2]); }));
  const Certificate certificate = certifyGrids(
      map, gridsOf(map, {.voxelSize = voxelSizeFor(map.chart().green().shape().surface().mesh(), 24)}));
  // One to one it is, so the way back leads back.
  EXPECT_THAT(failuresOf(certificate),
              ElementsAre("sphere_flips", "sphere_degree", "image_cells", "voxel_cells"));
}

TEST(WrongPhi, OneVertexBeyondItsRing) {
  std::vector<Vec3> directions = star().sphere().directions;
  const Triangle& t = triangles()[10];
  directions[t[0]] = (2 * directions[t[1]] + 2 * directions[t[2]] - 3 * directions[t[0]]).normalized();
  EXPECT_THAT(failures(withDirections(directions)), ElementsAre("sphere_flips", "image_cells"));
}

TEST(WrongPhi, FoldedOver) {
  // The cap above z = 0.8 lies on the ring below it; the triangles of its pole span the hole.
  const BallMap map = withDirections(moved([](const Vec3& u) {
    const double z = std::min(u[2], 1.6 - u[2]), ring = std::hypot(u[0], u[1]);
    const double share = std::sqrt(1 - z * z) / ring;
    return Vec3(share * u[0], share * u[1], z);
  }));
  EXPECT_THAT(failures(map), ElementsAre("sphere_flips", "image_cells"));
}

TEST(WrongPhi, NoiseFromVertexToVertex) {
  std::mt19937_64 engine(3);
  std::normal_distribution<> normal(0, 0.1);
  const BallMap map = withDirections(moved([&](const Vec3& u) {
    const Vec3 turn(normal(engine), normal(engine), normal(engine));
    return Vec3(Eigen::AngleAxisd(turn.norm(), turn.normalized()) * u);
  }));
  EXPECT_THAT(failures(map), ElementsAre("sphere_flips", "image_cells"));
}

TEST(WrongPhi, VerticesExchanged) {
  std::vector<Vec3> directions = star().sphere().directions;
  std::shuffle(directions.begin(), directions.end(), std::mt19937_64(4));
  const std::vector<std::string> found = failures(withDirections(directions));
  EXPECT_EQ(found.front(), "sphere_flips");
  EXPECT_THAT(found, Contains("image_cells"));
}

TEST(WrongPhi, TwiceAroundWithEveryCellPositive) {
  const BallMap ball = testing::ballMap(testing::starShape(icosphere(4), Vec3(0, 0, 0)));
  const GreenChart& chart = ball.chart();
  // Around an axis through two vertices, so that no triangle holds a branch point.
  const Vec3 axis = chart.green().shape().mesh().vertices[0].normalized(), x = axis.unitOrthogonal(),
             y = axis.cross(x);
  std::vector<Vec3> directions;
  for (const Vec3& v : chart.green().shape().mesh().vertices) {
    const Vec3 u = v.normalized();
    const double angle = 2 * std::atan2(u.dot(y), u.dot(x)), r = std::hypot(u.dot(x), u.dot(y));
    directions.push_back((u.dot(axis) * axis + r * (std::cos(angle) * x + std::sin(angle) * y)).normalized());
  }
  const SphereMap twice = testing::sphereMap(chart, directions);
  ASSERT_EQ(twice.flips, 0u);
  EXPECT_THAT(failures(BallMap(chart, twice, {.core = CoreMode::paper})), ElementsAre("sphere_degree"));
}

// --- the table -------------------------------------------------------------------------------------------

TEST(WrongTable, ACellOfTheFoliationTurnedOver) {
  GreenChart::Data data = partsOf(star().chart());
  Foliation& f = data.foliation;
  // The report still says that all is well.
  std::swap(f.nodes[f.nodeId(5, 3)], f.nodes[f.nodeId(8, 3)]);
  EXPECT_THAT(failures(mapOf(std::move(data), star().sphere())), ElementsAre("foliation_cells"));
}

BallMap withImages(const std::function<void(std::vector<Vec3>&)>& spoil) {
  NodeImages images = star().nodeImages();
  spoil(images.ball);
  return {star().chart(), star().sphere(), star().options(), star().radius(), images};
}

TEST(WrongTable, ImagesOfNodes) {
  const Foliation& f = star().chart().foliation();
  EXPECT_THAT(failures(withImages([](std::vector<Vec3>&) {})), IsEmpty());
  EXPECT_THAT(failures(withImages(
                  [&](std::vector<Vec3>& ball) { std::swap(ball[f.nodeId(5, 3)], ball[f.nodeId(8, 3)]); })),
              ElementsAre("image_radii", "image_cells"));
  for (const std::size_t level : {std::size_t{0}, std::size_t{4}}) {
    EXPECT_THAT(failures(withImages([&](std::vector<Vec3>& ball) { ball[f.nodeId(level, 7)] *= 1 + 1e-11; })),
                ElementsAre("image_radii"));
  }
  EXPECT_THAT(failures(withImages([](std::vector<Vec3>& ball) { ball.back()[1] = 1e-300; })),
              ElementsAre("center"));
}

TEST(WrongTable, LevelsThatDoNotFall) {
  GreenChart::Data data = partsOf(star().chart());
  data.foliation.levels[4] = data.foliation.levels[3];
  EXPECT_THAT(failures(BallMap(GreenChart(std::make_shared<GreenChart::Data>(data)), star().sphere(),
                               star().options(), star().radius(), star().nodeImages())),
              ElementsAre("image_radii"));
}

TEST(WrongTable, NumbersThatAreNone) {
  GreenChart::Data data = partsOf(star().chart());
  data.h[100] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(failures(mapOf(std::move(data), star().sphere())), ElementsAre("finite"));
}

// --- the center ------------------------------------------------------------------------------------------

TEST(WrongCenter, TheTableIsThatOfAnother) {
  const StarShape& shape = star().chart().green().shape();
  MapOptions options;
  options.largestAngle = 0;  // the same triangles
  const Vec3 center = shape.frame().origin + Vec3(0.05, 0.02, -0.03);
  const BallMap other = mapToBall(testing::starShape(shape.surface().mesh(), center), options);
  EXPECT_THAT(failures(other), IsEmpty());
  GreenChart::Data data = partsOf(other.chart());
  ASSERT_EQ(data.foliation.triangles, triangles());
  data.green = star().chart().green();
  EXPECT_THAT(failures(mapOf(std::move(data), other.sphere())), ElementsAre("boundary_attached"));
}

// All levels moved by a share of a vertex over the center, which stays.
BallMap withCenterTowards(double share) {
  GreenChart::Data data = partsOf(star().chart());
  Foliation& f = data.foliation;
  const Vec3 tip = *std::max_element(f.nodes.begin(), f.nodes.end(),
                                     [](const Vec3& a, const Vec3& b) { return a.norm() < b.norm(); });
  for (std::size_t id = 0; id < f.centerNode(); ++id) f.nodes[id] -= share * tip;
  return mapOf(std::move(data), star().sphere());
}

TEST(WrongCenter, OutsideTheKernel) {
  EXPECT_THAT(failures(withCenterTowards(0.95)),
              ElementsAre("boundary_attached", "surface_star", "foliation_cells"));
}

TEST(WrongCenter, OutsideTheSolid) {
  EXPECT_THAT(failures(withCenterTowards(1.2)),
              ElementsAre("boundary_attached", "surface_star", "sphere_degree", "foliation_cells"));
}

}  // namespace
}  // namespace polestar
