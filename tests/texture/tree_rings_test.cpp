// The fibers of a trunk and what is drawn along them.

#include <gtest/gtest.h>

#include "polestar/texture/procedural.h"
#include "support.h"

namespace polestar {
namespace {

TEST(TreeRings, FibersRunAlongTheTrunkAndTurnWithTheSpiral) {
  const auto points = testing::randomBallPoints(200, 1);
  std::vector<Vec3> fiber(points.size());
  makeTexture("tree-rings", {{"spiral", 0}})->fiber(points, fiber);
  for (const Vec3& f : fiber) EXPECT_GT(f.normalized()[2], 0.85);
  makeTexture("tree-rings", {{"spiral", 1.5}})->fiber(points, fiber);
  double turned = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    turned += fiber[i].dot(Vec3::UnitZ().cross(points[i] - Vec3(0.09, -0.06, 0)));
  }
  EXPECT_GT(turned, 0);
}

TEST(TreeRings, LooksAlikeAlongItsFibers) {
  // Without rays: color changes less along a fiber than across it, and less than along the axis.
  const auto texture = makeTexture("tree-rings", {{"spiral", 1.5}, {"rays", 0}, {"bark", 0}, {"wobble", 0}});
  double along = 0, across = 0, axis = 0;
  for (const Vec3& p : testing::randomBallPoints(1500, 2)) {
    const Vec3 q = 0.6 * p;
    Vec3 fiber;
    texture->fiber({&q, 1}, {&fiber, 1});
    const Vec3 step = 0.02 * fiber.normalized();
    const Vec3f here = testing::colorAt(*texture, q);
    along += (testing::colorAt(*texture, q + step) - here).norm();
    axis += (testing::colorAt(*texture, q + 0.02 * Vec3::UnitZ()) - here).norm();
    across += (testing::colorAt(*texture, q + 0.02 * fiber.unitOrthogonal()) - here).norm();
  }
  EXPECT_LT(along, 0.5 * across);
  EXPECT_LT(along, 0.85 * axis);
}

}  // namespace
}  // namespace polestar
