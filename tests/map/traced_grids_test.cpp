// Grids by traces, held against those by the table.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::ballMap;
using testing::pointsInside;
using testing::starShape;
using testing::starShapeFromFile;

const BallMap& star() {
  static const BallMap map = ballMap(starShape(smoothStar(3)));
  return map;
}

TEST(TracedSample, InsideItIsTheTracedMapWithTheFieldsOwnGreen) {
  const TracedBallMap traced(star());
  const GreenFunction& green = star().chart().green();
  std::vector<Vec3> x = pointsInside(green.shape(), 200);
  x.push_back(green.shape().frame().origin);
  std::vector<Vec3> ball(x.size()), forward(x.size());
  std::vector<double> value(x.size());
  EXPECT_EQ(traced.sample(x, ball, value), 0u);
  traced.forward(x, forward);
  EXPECT_EQ(ball, forward);
  const double unit = green.shape().frame().unit;
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    const Vec3 inner = green.shape().frame().toInner(x[i]);
    double g;
    Vec3 gradient;
    green.evaluate({&inner, 1}, {&g, 1}, {&gradient, 1});
    EXPECT_NEAR(value[i], g / unit, 1e-9 / unit);
    EXPECT_NEAR(ball[i].norm(), green.ballRadius(g), 1e-9);
  }
  EXPECT_EQ(value.back(), std::numeric_limits<double>::infinity());
}

TEST(TracedSample, BatchesDoNotMatter) {
  const TracedBallMap traced(star());
  const std::vector<Vec3> x = pointsInside(star().chart().green().shape(), 100);
  std::vector<Vec3> together(x.size()), alone(x.size()), other(x.size());
  traced.forward(x, together);
  for (std::size_t i = 0; i < x.size(); ++i) traced.forward({&x[i], 1}, {&alone[i], 1});
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((together[i] - alone[i]).norm(), 1e-12);
  withThreads(1, [&] { traced.forward(x, alone); });
  withThreads(2, [&] { traced.forward(x, other); });
  EXPECT_EQ(alone, other);
}

TEST(TracedSample, OutsideAndWhereTracesFailItIsTheTables) {
  const TracedBallMap traced(star());
  const TriMesh& mesh = star().chart().green().shape().surface().mesh();
  const Vec3 center = star().chart().green().shape().frame().origin;
  // Outside; and on the surface, where no line begins.
  std::vector<Vec3> x;
  for (const std::size_t v : {3, 40, 500}) x.push_back(center + 1.2 * (mesh.vertices[v] - center));
  for (const std::size_t v : {3, 40, 500}) x.push_back(mesh.vertices[v]);
  std::vector<Vec3> ball(x.size()), table(x.size()), forward(x.size());
  std::vector<double> green(x.size()), tableGreen(x.size());
  const std::size_t failed = traced.sample(x, ball, green);
  star().sample(x, table, tableGreen);
  traced.forward(x, forward);
  std::size_t unanswered = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (forward[i].allFinite()) continue;
    EXPECT_EQ(ball[i], table[i]);
    EXPECT_EQ(green[i], tableGreen[i]);
    unanswered += i >= 3;
  }
  EXPECT_TRUE(forward[0].hasNaN());
  EXPECT_EQ(failed, unanswered);
}

/// `rest` of all voxels inside.
std::vector<Vec3f> inside(const SolidGrids& grids) {
  std::vector<std::vector<Vec3f>> leaves(grids.leafCount("rest"));
  grids.visitBricks("rest", [&](std::size_t leaf, const SolidGrids::Brick& brick) {
    constexpr int n = SolidGrids::Brick::kSize;
    for (int i = 0; i < n * n * n; ++i) {
      const bool ofThis = i % n + 1 < n && i / n % n + 1 < n && i / (n * n) + 1 < n;
      if (ofThis && brick.active[i] && brick.signedDistance[i] < 0) leaves[leaf].push_back(brick.values[i]);
    }
  });
  std::vector<Vec3f> all;
  for (const auto& leaf : leaves) all.insert(all.end(), leaf.begin(), leaf.end());
  return all;
}

TEST(TracedGrids, AgreeWithTheTableOnARealModel) {
  POLESTAR_REQUIRE_MESHES();
  const BallMap map = ballMap(starShapeFromFile(*testing::meshFolder() / "castalia.obj"));
  const GridOptions options{.voxelSize = voxelSizeFor(map.chart().green().shape().surface().mesh(), 24)};
  const SolidGrids byTable = gridsOf(map, options);
  const TracedGrids traced = tracedGridsOf(map, options);
  const std::vector<Vec3f> a = inside(byTable), b = inside(traced.grids);
  ASSERT_EQ(a.size(), byTable.insideVoxels());
  ASSERT_EQ(a.size(), b.size());
  EXPECT_LE(traced.answeredByTable, a.size() / 200);
  double sum = 0, largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double off = (a[i] - b[i]).norm();
    sum += off;
    largest = std::max(largest, off);
  }
  const double mean = sum / static_cast<double>(a.size());
  EXPECT_GT(mean, 1e-5) << "these would be the same grids";
  EXPECT_LT(mean, 2e-4);
  EXPECT_LT(largest, 1e-2);
  EXPECT_EQ(certifyGrids(map, traced.grids, 1000).verdict, Verdict::proved);
}

}  // namespace
}  // namespace polestar
