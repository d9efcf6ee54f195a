// Where the complex goes: bodies that are moved copies of one another move as one, ends are met, velocities
// are derivatives.
#include "polestar/morph/morph_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "polestar/map/ball_motion.h"
#include "polestar/mesh/shapes.h"
#include "polestar/morph/frame_proof.h"
#include "shapes.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::coarse;
using testing::lobes;
using testing::movedLobes;
using testing::skewTurn;
using testing::waist;

constexpr PathKind kKinds[] = {PathKind::straight, PathKind::radial};

const MorphComplex& between() {
  static const MorphComplex complex({{lobes(), nullptr}, {waist(), nullptr}}, coarse());
  return complex;
}

double largestDifference(std::span<const Vec3> a, std::span<const Vec3> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

TEST(MorphPath, NodesAreTheInversesOfTheMaps) {
  const MorphComplex& complex = between();
  for (std::size_t s = 0; s < 2; ++s) {
    if (complex.report().ends[s].mending.moved > 0) continue;
    std::vector<Vec3> solid, ball(complex.ball().nodes.size());
    for (const Vec3& node : complex.nodes(s)) solid.push_back(complex.center(s) + node);
    complex.shape(s).map.forward(solid, ball);
    for (std::size_t id = complex.ball().vertexCount; id < ball.size(); ++id)
      ASSERT_LT((ball[id] - complex.ball().nodes[id]).norm(), 1e-6) << "node " << id;
  }
}

// A crease asks for levels a millionth apart; the other shape's table begins a hundredth below its surface.
TEST(MorphPath, ThinLevelsOfOneShapeFoldNoOther) {
  const BallMap& body = lobes();
  const double firstOfBody = body.radius().value(body.chart().foliation().levels[1]);
  const MorphComplex complex({{testing::ballMap(testing::starShape(cube(4))), nullptr}, {body, nullptr}},
                             coarse());
  ASSERT_GT(complex.ball().levels[1], 1 - 0.01 * (1 - firstOfBody)) << "the cube asks for thinner levels";
  EXPECT_EQ(complex.report().ends[1].mending.badBefore, 0u);
  EXPECT_TRUE(provePassage(complex, 0, 1).holds());
}

TEST(MorphPath, AShapeIntoItselfStaysWhatItIs) {
  const MorphComplex complex({{lobes(), nullptr}, {lobes(), nullptr}}, coarse());
  for (const PathKind kind : kKinds) {
    const MorphPath path(complex, kind);
    for (const double t : {0.0, 0.3, 1.0}) {
      const MorphPose pose = path.pose(std::vector<double>{1 - t, t});
      EXPECT_LT(largestDifference(pose.nodes, complex.nodes(0)), 1e-12) << toString(kind) << " at " << t;
    }
    const MorphFrame frame = path.frame(MorphTimeline::passage(2, 1, 10, Ease::linear), 4, 24);
    for (const Vec3& velocity : frame.velocity) ASSERT_LT(velocity.norm(), 1e-8);
  }
}

// f of the copy is f of the original by the motion, so every blend is a copy, too: moved, scaled.
TEST(MorphPath, AMovedAndScaledCopyMovesAndGrows) {
  const Vec3 shift(4, -1, 2);
  const MorphComplex complex({{lobes(), nullptr}, {movedLobes(Mat3::Identity(), 2, shift), nullptr}},
                             coarse());
  const MorphPath straight(complex, PathKind::straight), radial(complex, PathKind::radial);
  const double volume = proveFrame(complex, straight.pose(std::vector<double>{1, 0})).volume;
  for (const double t : {0.25, 0.5, 1.0}) {
    const std::vector<double> weights{1 - t, t};
    const MorphPose pose = straight.pose(weights), byRadii = radial.pose(weights);
    EXPECT_LT((pose.center - t * shift).norm(), 1e-12);
    const double grown = 1 + t, grownRadially = std::pow(2, t);
    std::vector<Vec3> expected(pose.nodes.size()), expectedRadially(pose.nodes.size());
    for (std::size_t id = 0; id < expected.size(); ++id) {
      expected[id] = grown * complex.nodes(0)[id];
      expectedRadially[id] = grownRadially * complex.nodes(0)[id];
    }
    EXPECT_LT(largestDifference(pose.nodes, expected), 2e-6);
    EXPECT_LT(largestDifference(byRadii.nodes, expectedRadially), 2e-6);
    EXPECT_NEAR(proveFrame(complex, pose).volume, std::pow(grown, 3) * volume, 1e-5 * volume);
  }
  const MorphFrame frame = straight.frame(MorphTimeline::passage(2, 0, 24, Ease::linear), 6, 24);
  for (std::size_t id = 0; id < frame.velocity.size(); ++id)
    ASSERT_LT((frame.velocity[id] - shift - complex.nodes(0)[id]).norm(), 1e-5);
}

TEST(MorphPath, ATurnedCopyTurnsAndDoesNotShrink) {
  const Mat3 turn = skewTurn();
  const MorphShape turned{movedLobes(turn, 1, Vec3::Zero()), std::make_shared<BallMotion>(turn), turn};
  const MorphComplex complex({{lobes(), nullptr}, turned}, coarse());
  for (const PathKind kind : kKinds) {
    const MorphPath path(complex, kind);
    const MorphPose pose = path.pose(std::vector<double>{0.5, 0.5});
    const Mat3 half = Eigen::AngleAxisd(1.75 / 2, Vec3(1, 2, -1).normalized()).toRotationMatrix();
    std::vector<Vec3> expected(complex.nodes(0).begin(), complex.nodes(0).end());
    for (Vec3& node : expected) node = half * node;
    EXPECT_LT(largestDifference(pose.nodes, expected), 2e-6) << toString(kind);
  }
}

TEST(MorphPath, CopiesOfBothShapesMoveAlike) {
  const Vec3 shift(1e4, 0, -2e4);
  TriMesh moved = waist().chart().green().shape().surface().mesh();
  for (Vec3& vertex : moved.vertices) vertex = 5 * vertex + shift;
  MorphOptions options = coarse();
  options.surfaceTolerance *= 5;
  const MorphComplex copies(
      {{movedLobes(Mat3::Identity(), 5, shift), nullptr},
       {testing::ballMap(testing::starShape(moved, 5 * between().center(1) + shift)), nullptr}},
      options);
  ASSERT_EQ(copies.ball().vertexCount, between().ball().vertexCount);
  const std::vector<double> weights{0.4, 0.6};
  for (const PathKind kind : kKinds) {
    const MorphPose pose = MorphPath(between(), kind).pose(weights),
                    copy = MorphPath(copies, kind).pose(weights);
    EXPECT_LT((copy.center - 5 * pose.center - shift).norm(), 1e-8);
    std::vector<Vec3> expected = pose.nodes;
    for (Vec3& node : expected) node *= 5;
    EXPECT_LT(largestDifference(copy.nodes, expected), 1e-4);
  }
}

TEST(MorphPath, EndsAreMetExactly) {
  for (const PathKind kind : kKinds) {
    const MorphPath path(between(), kind);
    for (std::size_t s = 0; s < 2; ++s) {
      std::vector<double> weights(2, 0);
      weights[s] = 1;
      EXPECT_LT(largestDifference(path.pose(weights).nodes, between().nodes(s)), 1e-12);
      EXPECT_LE(between().report().ends[s].surfaceMax, coarse().surfaceTolerance);
    }
  }
}

TEST(MorphPath, VelocitiesAreDerivatives) {
  const Mat3 turn = skewTurn();
  const MorphShape turned{movedLobes(turn, 1.5, Vec3(1, 0, 0)), std::make_shared<BallMotion>(turn), turn};
  const MorphComplex complex({{lobes(), nullptr}, turned, {waist(), nullptr}}, coarse());
  const MorphTimeline timeline = MorphTimeline::passage(3, 1, 25, Ease::smooth);
  for (const PathKind kind : kKinds) {
    const MorphPath path(complex, kind);
    for (const double at : {4.0, 10.5, 20.0}) {
      const MorphFrame frame = path.frame(timeline, at, 30);
      constexpr double kStep = 0.02;
      const MorphPose before = path.pose(timeline.weights(at - kStep)),
                      after = path.pose(timeline.weights(at + kStep));
      double largest = 0, worst = 0;
      for (std::size_t id = 0; id < frame.velocity.size(); ++id) {
        const Vec3 difference =
            (after.center + after.nodes[id] - before.center - before.nodes[id]) * (30 / (2 * kStep));
        largest = std::max(largest, difference.norm());
        worst = std::max(worst, (difference - frame.velocity[id]).norm());
      }
      EXPECT_GT(largest, 0.1);
      // Directions may pass an edge of the surfaces between the two.
      EXPECT_LT(worst, (kind == PathKind::straight ? 1e-3 : 5e-2) * largest)
          << toString(kind) << " at " << at;
    }
  }
}

TEST(MorphPath, RealBodiesMeetBothEnds) {
  POLESTAR_REQUIRE_MESHES();
  const std::filesystem::path folder = *testing::meshFolder();
  const BallMap castalia = testing::ballMap(testing::starShapeFromFile(folder / "castalia.obj")),
                golevka = testing::ballMap(testing::starShapeFromFile(folder / "golevka.stl"));
  const double length = boundingBox(castalia.chart().green().shape().surface().mesh()).extent().maxCoeff();
  const MorphComplex complex({{castalia, nullptr}, {golevka, nullptr}},
                             {.surfaceTolerance = length / 128 / 4});
  for (const MorphReport::End& end : complex.report().ends) {
    EXPECT_LT(end.surfaceMax, 0.5 * length / 128);
    EXPECT_EQ(end.mending.badAfter, 0U);
  }
}

}  // namespace
}  // namespace polestar
