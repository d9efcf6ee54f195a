// The opponents of the benchmark and its measures, held to exact answers.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "level_set_paths.h"
#include "morph_page.h"
#include "pair.h"
#include "polestar/mesh/self_intersection.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/solids.h"

namespace polestar::bench {
namespace {

TriMesh ball(double radius) {
  return transformed(icosphere(4), [radius](const Vec3& x) -> Vec3 { return radius * x; });
}

double volumeOfBall(double radius) { return 4 * std::numbers::pi / 3 * std::pow(radius, 3); }

constexpr double kVoxel = 0.05;

// Distances from concentric balls are |x| - r: their blend is a ball of the blended radius.
TEST(BlendedDistances, OfConcentricBallsAreBalls) {
  const LevelSetPair pair(ball(0.6), ball(1), kVoxel);
  std::vector<double> volumes;
  pair.blend(5, [&](const LevelSetFrame& frame) {
    volumes.push_back(frame.volume);
    const Topology topology = topologyOf(frame.surface);
    EXPECT_EQ(topology.parts, 1U);
    EXPECT_EQ(topology.handles, 0);
  });
  ASSERT_EQ(volumes.size(), 5U);
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const double expected = volumeOfBall(0.6 + 0.1 * static_cast<double>(i));
    EXPECT_NEAR(volumes[i], expected, 0.02 * expected) << i;
  }
}

TEST(LevelSetMorphingPath, GrowsABallIntoALargerOne) {
  const LevelSetPair pair(ball(0.6), ball(1), kVoxel);
  std::vector<double> volumes;
  TriMesh last;
  pair.morph(5, [&](const LevelSetFrame& frame) {
    volumes.push_back(frame.volume);
    last = frame.surface;
  });
  ASSERT_EQ(volumes.size(), 5U);
  EXPECT_NEAR(volumes.front(), volumeOfBall(0.6), 0.02 * volumes.front());
  EXPECT_NEAR(volumes.back(), volumeOfBall(1), 0.02 * volumes.back());
  for (std::size_t i = 1; i < volumes.size(); ++i) EXPECT_GT(volumes[i], volumes[i - 1]);
  EXPECT_LT(rootMeanSquare(pair.distancesToLast(last.vertices)), 0.2 * kVoxel);
}

TEST(DistancesToLast, AreThoseOfABall) {
  const LevelSetPair pair(ball(0.6), ball(1), kVoxel);
  const std::vector<double> distances = pair.distancesToLast({{1, 0, 0}, {0.7, 0, 0}, {0, 0, -1.2}});
  EXPECT_NEAR(distances[0], 0, 0.2 * kVoxel);
  EXPECT_NEAR(distances[1], 0.3, 0.2 * kVoxel);
  EXPECT_NEAR(distances[2], 0.2, 0.2 * kVoxel);
}

// A ball and its copy, half a turn about z apart: straight ways all meet the axis. Two maps would bring the
// copies into line; vertices by direction do not move at all.
TEST(VertexPathsTest, CollapseWhereACopyIsTurned) {
  const TriMesh mesh = ball(1);
  VertexPaths paths{mesh.triangles, mesh.vertices, {}};
  for (const Vec3& v : mesh.vertices) paths.last.emplace_back(-v.x(), -v.y(), v.z());
  EXPECT_EQ(findSelfIntersections(paths.at(0)).pairs, 0U);
  EXPECT_EQ(findSelfIntersections(paths.at(1)).pairs, 0U);
  EXPECT_GT(findSelfIntersections(paths.at(0.45)).pairs + findSelfIntersections(paths.at(0.5)).pairs, 0U);
  const auto width = [&](double t) {
    const Box box = boundingBox(paths.at(t));
    return box.extent().x();
  };
  EXPECT_NEAR(width(0.25), 1, 1e-3);
  EXPECT_NEAR(width(0.5), 0, 1e-12);
}

TEST(VertexPathsTest, EndOnBothSurfaces) {
  const auto shape = [](double radius, const Vec3& shift) {
    return testing::starShape(
        transformed(smoothStar(3), [&](const Vec3& x) -> Vec3 { return radius * x + shift; }), shift);
  };
  const Vec3 shift(3, 1, 0);
  const MorphComplex complex(
      {{testing::ballMap(shape(1, Vec3(0, 0, 0))), nullptr}, {testing::ballMap(shape(2, shift)), nullptr}},
      {.surfaceTolerance = 0.02, .largestAngle = 0.3});
  // A scaled copy: both correspondences are the scaling.
  for (const VertexPaths& paths : {bySphereMaps(complex), byDirections(complex)}) {
    ASSERT_EQ(paths.first.size(), paths.last.size());
    for (std::size_t v = 0; v < paths.first.size(); ++v)
      ASSERT_LT((paths.last[v] - shift - 2 * paths.first[v]).norm(), 1e-4);
  }
}

TEST(TopologyOf, CountsPartsAndHandles) {
  TriMesh two = icosphere(1);
  const auto count = static_cast<std::int32_t>(two.vertices.size());
  const TriMesh one = two;
  for (const Vec3& v : one.vertices) two.vertices.push_back(v + Vec3(3, 0, 0));
  for (const Triangle& t : one.triangles) two.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  EXPECT_EQ(topologyOf(two).parts, 2U);
  EXPECT_EQ(topologyOf(two).handles, 0);

  // A torus of 4 x 4 quads.
  TriMesh torus;
  torus.vertices.resize(16, Vec3::Zero());
  for (std::int32_t i = 0; i < 4; ++i) {
    for (std::int32_t j = 0; j < 4; ++j) {
      const auto at = [](std::int32_t a, std::int32_t b) { return 4 * (a % 4) + b % 4; };
      torus.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      torus.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  EXPECT_EQ(topologyOf(torus).parts, 1U);
  EXPECT_EQ(topologyOf(torus).handles, 1);
}

TEST(RelativeVolume, IsThatOfTheGeometricBlend) {
  const Json row{{"volumes_of_ends", {2.0, 8.0}}};
  EXPECT_DOUBLE_EQ(relativeVolume(row, {{"t", 0.5}, {"volume", 4.0}}), 1);
  EXPECT_DOUBLE_EQ(relativeVolume(row, {{"t", 0.5}, {"volume", 5.0}}), 1.25);
}

}  // namespace
}  // namespace polestar::bench
