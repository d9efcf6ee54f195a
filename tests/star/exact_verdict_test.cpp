// The verdict on single points, against the definition in rational arithmetic.

#include "polestar/star/detail/exact_verdict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "polestar/mesh/shapes.h"
#include "star/bodies.h"
#include "support/exact.h"

namespace polestar::detail {
namespace {

ExactVerdict judge(const TriMesh& mesh, const Vec3& center, double unit = 4) {
  return judgeCenter(mesh, center, unit, Context::quiet());
}

TEST(ExactVerdict, OneUlpDecidesOnTheRim) {
  const TriMesh mesh = cube(3);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      Vec3 center(0.125, 0.25, -0.375);
      center[axis] = std::nextafter(side, 0.0);
      EXPECT_TRUE(judge(mesh, center).star());
      center[axis] = side;
      EXPECT_FALSE(judge(mesh, center).star());
      EXPECT_EQ(judge(mesh, center).badFaces.size(), 18u);
      center[axis] = std::nextafter(side, 2 * side);
      EXPECT_FALSE(judge(mesh, center).star());
    }
  }
}

TEST(ExactVerdict, OneUlpDecidesOnSlantedPlanes) {
  // x + y + z = 1 is a plane of the kernel; these numbers lie on it exactly.
  const TriMesh mesh = testing::stellaOctangula();
  const Vec3 onPlane(0.25, 0.25, 0.5);
  EXPECT_FALSE(judge(mesh, onPlane).star());
  EXPECT_EQ(judge(mesh, onPlane).badFaces.size(), 3u);
  EXPECT_FALSE(judge(mesh, Vec3(0.25, 0.25, std::nextafter(0.5, 1))).star());
  EXPECT_TRUE(judge(mesh, Vec3(0.25, 0.25, 0.5 - 1e-15)).star());
}

TEST(ExactVerdict, AgreesWithRationalArithmeticNearTheRim) {
  const TriMesh mesh = testing::stellaOctangula();
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<> uniform(0, 1);
  int yes = 0, no = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    // On the octahedron's rim but for a few units in the last place.
    Vec3 c(uniform(engine), uniform(engine), uniform(engine));
    c /= c.sum();
    c *= 1 + (trial % 9 - 4) * 1e-16;
    const ExactVerdict verdict = judge(mesh, c);
    // A yes is one for the given coordinates and for the stored ones; a no has a reason in one of them.
    const bool given = testing::seesEveryFace(mesh, c);
    const bool stored = testing::seesEveryFace(verdict.mesh, Vec3::Zero());
    EXPECT_EQ(verdict.badFaces.empty(), given && stored);
    ++(verdict.star() ? yes : no);
  }
  EXPECT_GT(yes, 200);
  EXPECT_GT(no, 200);
}

TEST(ExactVerdict, TheInnerMeshHasItsCenterAtTheOriginAndTouchesTheUnitSphere) {
  const TriMesh mesh =
      transformed(smoothStar(3), [](const Vec3& v) { return Vec3(1e-7 * v + Vec3(2e-7, 0, -3e-7)); });
  const Vec3 center(2.1e-7, 0.1e-7, -3e-7);
  const ExactVerdict verdict = judge(mesh, center, 0x1p-22);
  double farthest = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    farthest = std::max(farthest, verdict.mesh.vertices[i].norm());
    EXPECT_LT((verdict.frame.toWorld(verdict.mesh.vertices[i]) - mesh.vertices[i]).norm(), 1e-21);
  }
  EXPECT_NEAR(farthest, 1, 1e-15);
  EXPECT_EQ(verdict.frame.origin, center);
}

TEST(ExactVerdict, ASurfaceThatWindsTwiceIsNotStarShaped) {
  const ExactVerdict verdict = judge(testing::twiceAround(), Vec3::Zero());
  EXPECT_TRUE(verdict.badFaces.empty());  // by half-spaces alone it would pass
  EXPECT_EQ(verdict.windings, 2);
  EXPECT_FALSE(verdict.star());
  EXPECT_EQ(judge(cube(2), Vec3(0.1, 0.2, 0.3)).windings, 1);
}

TEST(ExactVerdict, FacesWithoutAreaAreNeverInside) {
  TriMesh mesh = cube(1);
  mesh.vertices.push_back((mesh.vertices[mesh.triangles[0][0]] + mesh.vertices[mesh.triangles[0][1]]) / 2);
  mesh.triangles.push_back(
      {mesh.triangles[0][0], static_cast<std::int32_t>(mesh.vertices.size()) - 1, mesh.triangles[0][1]});
  const ExactVerdict verdict = judge(mesh, Vec3::Zero());
  EXPECT_EQ(verdict.badFaces, std::vector<std::int32_t>{12});
  EXPECT_EQ(verdict.zeroAreaFaces, 1u);
}

TEST(ExactVerdict, ACenterOutOfThisWorldIsJustOutside) {
  for (const double far : {1e3, 1e30, 1e300}) {
    EXPECT_FALSE(judge(cube(2), Vec3(far, 0, 0)).star());
    EXPECT_FALSE(judge(cube(2), Vec3(-far, far, far)).star());
  }
}

}  // namespace
}  // namespace polestar::detail
