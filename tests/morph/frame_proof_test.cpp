// What is proved of frames, and what is refused.
#include "polestar/morph/frame_proof.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "shapes.h"
#include "support/formula_map.h"

namespace polestar {
namespace {

using testing::coarse;
using ::testing::HasSubstr;
using testing::lobes;
using testing::waist;

const MorphComplex& between() {
  static const MorphComplex complex({{lobes(), nullptr}, {waist(), nullptr}}, coarse());
  return complex;
}

MorphPose middle() { return MorphPath(between(), PathKind::straight).pose(std::vector<double>{0.5, 0.5}); }

TEST(MorphProof, GoodFramesAreProved) {
  for (const PathKind kind : {PathKind::straight, PathKind::radial}) {
    const MorphPath path(between(), kind);
    for (const double t : {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}) {
      const FrameProof proof = proveFrame(between(), path.pose(std::vector<double>{1 - t, t}));
      EXPECT_TRUE(proof.holds()) << proof.fault();
      EXPECT_EQ(proof.fault(), "");
      EXPECT_EQ(proof.embedding, Embedding::starShaped);
      EXPECT_EQ(proof.winding, 1);
    }
  }
  EXPECT_TRUE(provePassage(between(), 0, 1).holds());
}

TEST(MorphProof, ANodeThatCrossesItsNeighboursIsFound) {
  MorphPose pose = middle();
  const Foliation& ball = between().ball();
  std::swap(pose.nodes[ball.nodeId(3, 10)], pose.nodes[ball.nodeId(3, 200)]);
  const FrameProof proof = proveFrame(between(), pose);
  EXPECT_FALSE(proof.holds());
  EXPECT_GT(proof.cells.bad(), 10U);
  ASSERT_TRUE(proof.firstBad);
  EXPECT_THAT(proof.fault(), HasSubstr("tetrahedra are inverted or flat, the first around ("));
}

TEST(MorphProof, AMirroredFrameIsRefused) {
  MorphPose pose = middle();
  for (Vec3& node : pose.nodes) node.x() *= -1;
  const FrameProof proof = proveFrame(between(), pose);
  EXPECT_FALSE(proof.holds());
  EXPECT_EQ(proof.cells.bad(), proof.cells.cells);
  EXPECT_EQ(proof.winding, -1);
}

// Positive cells alone are not enough: a surface that is not seen from the center may still be embedded.
TEST(MorphProof, SurfacesThatAreNotSeenAreLookedAtForCrossings) {
  MorphPose pose = middle();
  // A bend that no ray from the center follows, one to one on all of space.
  for (Vec3& node : pose.nodes) node = Vec3(node.x(), node.y() + 3 * node.x() * node.x(), node.z());
  const FrameProof bent = proveFrame(between(), pose);
  EXPECT_GT(bent.hiddenTriangles, 0U);
  EXPECT_EQ(bent.crossings, 0U);
  EXPECT_EQ(bent.embedding, Embedding::noCrossing);
  // A vertex pulled through to the other side.
  pose = middle();
  pose.nodes[5] *= -1.5;
  EXPECT_EQ(proveFrame(between(), pose).embedding, Embedding::none);
}

// One to one, but so quick a turn from shell to shell that straight cells cannot follow.
TEST(MorphProof, ATwistedMapIsRefused) {
  const auto twist = [](double sign) {
    return [sign](const Vec3& y) {
      const double angle = sign * 12 * y.norm();
      return Vec3(Eigen::AngleAxisd(angle, Vec3::UnitZ()) * y);
    };
  };
  const MorphShape twisted{lobes(), std::make_shared<testing::FormulaMap>(twist(1), twist(-1))};
  MorphOptions options = coarse();
  options.mostVertices = 5000;
  const MorphComplex complex({{lobes(), nullptr}, twisted}, options);
  bool refused = false;
  const MorphPath path(complex, PathKind::straight);
  for (const double t : {0.25, 0.5, 0.75, 1.0}) {
    const FrameProof proof = proveFrame(complex, path.pose(std::vector<double>{1 - t, t}));
    refused = refused || !proof.holds();
    EXPECT_EQ(proof.holds(), proof.fault().empty());
  }
  EXPECT_TRUE(refused);
  EXPECT_GT(provePassage(complex, 0, 1).open, 0U);
}

// The cubics know of what happens between frames: halfway through, this turn of half a circle is flat.
TEST(MorphProof, APassageThroughAFlatFrameIsOpen) {
  const auto turn = [](const Vec3& y) { return Vec3(-y.x(), -y.y(), y.z()); };
  const MorphShape turned{lobes(), std::make_shared<testing::FormulaMap>(turn, turn)};
  const MorphComplex complex({{lobes(), nullptr}, turned}, coarse());
  const MorphPath path(complex, PathKind::straight);
  EXPECT_TRUE(proveFrame(complex, path.pose(std::vector<double>{1, 0})).holds());
  EXPECT_TRUE(proveFrame(complex, path.pose(std::vector<double>{0, 1})).holds());
  EXPECT_GT(provePassage(complex, 0, 1).open, complex.ball().cellCount() / 2);
}

}  // namespace
}  // namespace polestar
