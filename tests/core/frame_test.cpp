#include "polestar/core/frame.h"

#include <gtest/gtest.h>

#include <random>

namespace polestar {
namespace {

TEST(Frame, TheDefaultIsTheIdentity) {
  const Vec3 p(1.25, -3, 1e-9);
  EXPECT_EQ(Frame{}.toInner(p), p);
  EXPECT_EQ(Frame{}.toWorld(p), p);
}

TEST(Frame, OriginAndUnit) {
  const Frame frame{Vec3(1, 2, 3), 4};
  EXPECT_EQ(frame.toInner(Vec3(1, 2, 3)), Vec3::Zero());
  EXPECT_EQ(frame.toInner(Vec3(5, 2, 3)), Vec3::UnitX());
  EXPECT_EQ(frame.toWorld(Vec3(0, -1, 0)), Vec3(1, -2, 3));
}

TEST(Frame, RoundTripsLoseOnlyTheRoundingOfTheWorldCoordinates) {
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<> uniform(-1, 1);
  for (const Frame& frame : {Frame{Vec3(0.1, 0.2, -0.3), 0.7}, Frame{Vec3(1e6, -2e6, 5e5), 1.3},
                             Frame{Vec3(4e-9, 8e-9, -5e-9), 1.7e-7}, Frame{Vec3(1e6, 0, 0), 1e-3}}) {
    const double worldUlp = std::numeric_limits<double>::epsilon() * (frame.origin.norm() + frame.unit);
    for (int i = 0; i < 1000; ++i) {
      const Vec3 inner(uniform(engine), uniform(engine), uniform(engine));
      const Vec3 back = frame.toInner(frame.toWorld(inner));
      EXPECT_LT((back - inner).norm(), 4 * worldUlp / frame.unit);
    }
  }
}

}  // namespace
}  // namespace polestar
