// Solids brought into line without landmarks: turned copies are found again, mirrored and round ones do no
// harm.
#include "polestar/map/alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::starShape;

constexpr double kDegree = std::numbers::pi / 180;

const std::array<Mat3, 3> kTurns{Eigen::AngleAxisd(0.3, Vec3(1, 0.2, -0.4).normalized()).toRotationMatrix(),
                                 Eigen::AngleAxisd(1.9, Vec3(-0.3, 1, 0.5).normalized()).toRotationMatrix(),
                                 Eigen::AngleAxisd(3.1, Vec3(0.7, -0.6, 1).normalized()).toRotationMatrix()};

double angleOf(const Mat3& rotation) { return Eigen::AngleAxisd(rotation).angle(); }

void expectTurnsFound(const TriMesh& mesh) {
  const StarShape shape = starShape(mesh);
  for (const Mat3& turn : kTurns) {
    const StarShape copy =
        starShape(transformed(mesh, [&](const Vec3& x) { return Vec3(2.5 * (turn * x) + Vec3(7, -3, 1)); }));
    const Alignment found = alignSolids(shape, copy);
    EXPECT_LT(angleOf(found.rotation * turn.transpose()), 1 * kDegree);
    EXPECT_GT(found.correlation, 0.99);
    EXPECT_GE(found.correlation, found.runnerUpCorrelation);
  }
}

TEST(Alignment, FindsTurnedCopiesOfBodiesByFormula) { expectTurnsFound(stylizedHead(10)); }

TEST(Alignment, FindsTurnedCopiesOfRealModels) {
  POLESTAR_REQUIRE_MESHES();
  for (const std::string& name :
       testing::chosenModels({"golevka.stl", "KW4Alpha.obj"}, {"bennu.ply", "psyche.obj", "castalia.obj"})) {
    SCOPED_TRACE(name);
    expectTurnsFound(testing::starShapeFromFile(*testing::meshFolder() / name).surface().mesh());
  }
}

TEST(Alignment, FindsWhereItSees) {
  // Nearly round, but for one bump.
  const auto bump = [](const Vec3& place) {
    return radialShape(4,
                       [place](const Vec3& u) { return 1 + 0.3 * std::exp(-8 * (u - place).squaredNorm()); });
  };
  const Vec3 place = Vec3(1, 1, 0).normalized();
  const Alignment found =
      alignSolids(starShape(bump(Vec3::UnitX()), Vec3(0, 0, 0)), starShape(bump(place), Vec3(0, 0, 0)));
  EXPECT_LT((found.rotation * Vec3::UnitX() - place).norm(), 0.01);
  EXPECT_TRUE(found.ambiguous) << "it may spin about the bump";
  // Of all that agree, the smallest turn.
  EXPECT_LT(angleOf(found.rotation), 70 * kDegree);
}

TEST(Alignment, SaysWhatIsAmbiguous) {
  const Alignment cubes = alignSolids(starShape(cube(6)), starShape(cube(6)));
  EXPECT_TRUE(cubes.ambiguous);
  EXPECT_LT(angleOf(cubes.rotation), 0.1 * kDegree) << "the smallest of 24";
  const Alignment round = alignSolids(starShape(icosphere(4)), starShape(smoothStar(3)));
  EXPECT_TRUE(round.ambiguous);
  EXPECT_TRUE(round.rotation.isIdentity(0));
  // A sphere whose facets are seen is no less round.
  const Alignment coarse = alignSolids(starShape(icosphere(2)), starShape(smoothStar(3)));
  EXPECT_TRUE(coarse.ambiguous);
  EXPECT_TRUE(coarse.rotation.isIdentity(0));
}

TEST(Alignment, AMirroredBodyDoesNoHarm) {
  TriMesh mirrored = transformed(asteroid(10), [](const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); });
  for (Triangle& t : mirrored.triangles) std::swap(t[0], t[1]);
  const Alignment found = alignSolids(starShape(asteroid(10)), starShape(mirrored));
  EXPECT_NEAR(found.rotation.determinant(), 1, 1e-9);
  EXPECT_LT(found.correlation, 0.99);
  EXPECT_GE(found.correlation, found.correlationBefore - 1e-6);
}

TEST(Alignment, TheMotionOfATurnedCopyIsItsTurn) {
  const Mat3& turn = kTurns[1];
  const BallMap map = testing::ballMap(starShape(smoothStar(3)));
  const BallMap copy =
      testing::ballMap(starShape(transformed(smoothStar(3), [&](const Vec3& x) { return Vec3(turn * x); })));
  const LandmarkMatch match = alignedMotion(map, copy, turn);
  EXPECT_FALSE(match.refined);
  EXPECT_LT(match.worst, 1e-3);
  EXPECT_LT(angleOf(match.rotation * turn.transpose()), 0.1 * kDegree);
}

TEST(Alignment, TheMotionBringsDirectionsTogether) {
  const BallMap star = testing::ballMap(starShape(smoothStar(3)));
  const BallMap rock = testing::ballMap(starShape(asteroid(10)));
  MatchOptions plain;
  plain.refine = false;
  const LandmarkMatch rough = alignedMotion(star, rock, Mat3::Identity(), plain),
                      fine = alignedMotion(star, rock, Mat3::Identity());
  EXPECT_LT(fine.rms, 0.2 * rough.rms);
  EXPECT_LT(fine.rms, 0.5 * kDegree);
  EXPECT_TRUE(fine.refined);
}

}  // namespace
}  // namespace polestar
