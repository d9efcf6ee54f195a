// Chains of maps, and points that miss the surface by a little.
#include "polestar/map/composed_map.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/map/snapping_map.h"
#include "polestar/mesh/shapes.h"
#include "support/formula_map.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::FormulaMap;

/// x -> A x + b; nowhere for x.x > 100.
std::shared_ptr<const VolumeMap> affine(const Mat3& a, const Vec3& b) {
  const Mat3 back = a.inverse();
  return std::make_shared<FormulaMap>(
      [=](const Vec3& x) { return x.x() > 100 ? testing::kNotANumber : Vec3(a * x + b); },
      [=](const Vec3& y) { return Vec3(back * (y - b)); });
}

TEST(ComposedMap, IsTheProductOfItsLinks) {
  Mat3 a, b;
  a << 1, 2, 0, 0, 3, 1, 0, 0, 2;
  b << 2, 0, 1, 0, 1, 0, 1, 0, 3;
  const Vec3 shift(1, -2, 0.5);
  const Mat3 turn = rotationXyz({90, 0, 45});
  ComposedMap map;
  map.thenForward(affine(a, shift)).thenRotate(turn).thenInverse(affine(b, Vec3::Zero()));
  const std::vector<Vec3> x{{0.1, 0.2, 0.3}, {-1, 2, 0}, {101, 0, 0}};
  std::vector<Vec3> y(3), back(3);
  map.forward(x, y);
  map.inverse(y, back);
  std::vector<Mat3> jacobian(3);
  map.jacobian(x, jacobian);
  const Mat3 product = b.inverse() * turn * a;
  for (int i = 0; i < 2; ++i) {
    EXPECT_LT((y[i] - (product * x[i] + b.inverse() * turn * shift)).norm(), 1e-12);
    EXPECT_LT((back[i] - x[i]).norm(), 1e-12);
    EXPECT_LT((jacobian[i] - product).norm(), 1e-7);
  }
  EXPECT_TRUE(y[2].hasNaN());

  map.inverted().forward(y, back);
  EXPECT_LT((back[0] - x[0]).norm(), 1e-12);
  map.inverted().jacobian(y, jacobian);
  EXPECT_LT((jacobian[0] - product.inverse()).norm(), 1e-7);
}

TEST(ComposedMap, WithoutLinksIsTheIdentity) {
  const ComposedMap map;
  const std::vector<Vec3> x{{1, 2, 3}};
  std::vector<Vec3> y(1);
  std::vector<Mat3> jacobian(1);
  map.forward(x, y);
  map.jacobian(x, jacobian);
  EXPECT_EQ(y[0], x[0]);
  EXPECT_EQ(jacobian[0], Mat3::Identity());
}

TEST(ComposedMap, RotationsGoAboutXThenYThenZ) {
  EXPECT_LT((rotationXyz({90, 0, 0}) * Vec3::UnitY() - Vec3::UnitZ()).norm(), 1e-15);
  EXPECT_LT((rotationXyz({0, 90, 0}) * Vec3::UnitZ() - Vec3::UnitX()).norm(), 1e-15);
  EXPECT_LT((rotationXyz({0, 0, 90}) * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-15);
  EXPECT_LT((rotationXyz({90, 0, 90}) * Vec3::UnitY() - Vec3::UnitZ()).norm(), 1e-15);
}

class Snapping : public ::testing::Test {
 protected:
  static const BallMap& table() {
    static const BallMap map = testing::ballMap(testing::starShape(smoothStar(3)));
    return map;
  }
  static const TriMesh& surface() { return table().chart().green().shape().surface().mesh(); }
  static Vec3 center() { return table().chart().green().shape().frame().origin; }
  static Vec3 off(std::size_t vertex, double relative) {
    return center() + (1 + relative) * (surface().vertices[vertex] - center());
  }
};

TEST_F(Snapping, TakesRoundingForTheSurface) {
  const SnappingMap map(table(), std::make_shared<BallMap>(table()), 1e-6);
  const std::vector<Vec3> x{off(17, 0), off(17, 1e-7), off(17, -1e-7), off(17, 1e-4),
                            Vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
  std::vector<Vec3> y(x.size());
  map.forward(x, y);
  for (int i = 0; i < 3; ++i) EXPECT_LT((y[i] - table().sphere().directions[17]).norm(), 1e-5) << i;
  for (int i = 0; i < 2; ++i) EXPECT_LE(y[i].norm(), 1 + 1e-15);
  EXPECT_TRUE(y[3].hasNaN());
  EXPECT_TRUE(y[4].hasNaN());

  std::vector<double> distance(x.size());
  map.outsideSolid(x, distance);
  const double radius = (surface().vertices[17] - center()).norm();
  EXPECT_NEAR(distance[1], 1e-7 * radius, 1e-9 * radius);
  EXPECT_EQ(distance[2], 0);
  EXPECT_NEAR(distance[3], 1e-4 * radius, 1e-6 * radius);
  EXPECT_TRUE(std::isnan(distance[4]));

  std::vector<Mat3> jacobian(x.size());
  map.jacobian(x, jacobian);
  for (int i = 0; i < 3; ++i) EXPECT_GT(jacobian[i].determinant(), 0) << i;
}

TEST_F(Snapping, ReachGrowsWhenAsked) {
  const SnappingMap map(table(), std::make_shared<BallMap>(table()), 1e-3);
  const std::vector<Vec3> x{off(17, 1e-4)};
  std::vector<Vec3> y(1);
  map.forward(x, y);
  EXPECT_LT((y[0] - table().sphere().directions[17]).norm(), 1e-12);
}

TEST_F(Snapping, FromTheBallToo) {
  const SnappingMap map(table(), std::make_shared<BallMap>(table()), 1e-6);
  const Vec3 direction = table().sphere().directions[17];
  const std::vector<Vec3> y{direction, (1 + 1e-7) * direction, 1.01 * direction};
  std::vector<Vec3> x(3);
  map.inverse(y, x);
  for (int i = 0; i < 2; ++i) EXPECT_LT((x[i] - surface().vertices[17]).norm(), 1e-9) << i;
  EXPECT_TRUE(x[2].hasNaN());
  std::vector<double> distance(3);
  SnappingMap::outsideBall(y, distance);
  EXPECT_NEAR(distance[2], 0.01, 1e-12);
}

TEST_F(Snapping, TheTableStandsInForTracesFromTheSurface) {
  const SnappingMap map(table(), std::make_shared<TracedBallMap>(table()), 1e-6);
  std::vector<Vec3> x(surface().vertices.begin(), surface().vertices.begin() + 50), y(50);
  map.forward(x, y);
  for (std::size_t i = 0; i < x.size(); ++i)
    EXPECT_LT((y[i] - table().sphere().directions[i]).norm(), 2e-2) << i;
}

TEST_F(Snapping, RefusesANegativeReach) {
  EXPECT_THROW(SnappingMap(table(), std::make_shared<BallMap>(table()), -1), Error);
}

}  // namespace
}  // namespace polestar
