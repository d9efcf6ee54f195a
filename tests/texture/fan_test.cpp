#include "polestar/texture/detail/fan.h"

#include <gtest/gtest.h>

#include "support.h"

namespace polestar::detail {
namespace {

TEST(Fan, IsThePointInOtherCoordinates) {
  for (const double half : {0.0, 0.5}) {
    for (const Vec3& p : testing::randomBallPoints(300, 1)) {
      const Fan fan(VaryingPoint(p), half);
      const Vec3 back = fan.foot.value * Vec3::UnitZ() + fan.distance.value * fan.direction.value();
      EXPECT_NEAR((back - p).norm(), 0, 1e-12);
      EXPECT_NEAR((fanDirection(p, half) - fan.direction.value()).norm(), 0, 1e-12);
      // Along the fan neither foot nor direction change.
      const Fan further(VaryingPoint(p + 0.01 * fan.direction.value()), 0);
      if (half == 0) {
        EXPECT_NEAR((further.direction.value() - fan.direction.value()).norm(), 0, 1e-9);
      }
    }
  }
}

TEST(FanStreaks, RunAlongTheFanAndKeepTheirThickness) {
  const Footprint point(Mat3::Zero());
  const Streaks streaks{0.02, 12};
  for (const double distance : {0.25, 0.5, 0.9}) {
    double squares = 0, along = 0, across = 0;
    int count = 0;
    for (const Vec3& d : testing::randomDirections(3000, 2)) {
      const Vec3 p = distance * d;
      const auto at = [&](const Vec3& q) {
        return fanStreaks(Fan(VaryingPoint(q), 0), point, streaks, 1).value;
      };
      const double here = at(p);
      squares += here * here;
      along += here * at(p + 0.05 * d);
      across += here * at(p + 0.02 * d.unitOrthogonal());
      ++count;
    }
    EXPECT_NEAR(squares / count, 1, 0.12) << distance;
    EXPECT_GT(along / squares, 0.6) << distance;
    EXPECT_LT(across / squares, 0.25) << distance;
  }
}

}  // namespace
}  // namespace polestar::detail
