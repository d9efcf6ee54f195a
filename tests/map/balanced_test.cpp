#include "polestar/map/balanced.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <numbers>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/solids.h"

namespace polestar {
namespace {

TriMesh longBody() {
  return radialShape(
      3, [](const Vec3& w) { return (1 + 0.15 * w[2] * w[0]) / std::hypot(w[0] / 2, w[1], w[2] / 0.8); });
}

const GreenChart& chart() {
  static const GreenChart value = traceChart(solveGreen(testing::starShape(longBody())));
  return value;
}

SphereMap fieldLines() { return fieldLineSphereMap(chart().green().shape(), chart().directions()); }

/// The energy of method and header, cell by cell.
double energyOf(const GreenChart& c, std::span<const Vec3> phi, const RadiusProfile& radius, double weight) {
  const Foliation& f = c.foliation();
  const double volume = volumesWithin(f)[0];
  double sum = 0;
  for (std::size_t id = 0; id < f.cellCount(); ++id) {
    const auto node = f.cell(id);
    auto image = [&](std::uint32_t n) {
      return n == f.centerNode() ? Vec3(Vec3::Zero())
                                 : Vec3(radius.value(f.levels[n / f.vertexCount]) * phi[n % f.vertexCount]);
    };
    Mat3 from, to;
    for (int k = 0; k < 3; ++k) {
      from.col(k) = f.nodes[node[k + 1]] - f.nodes[node[0]];
      to.col(k) = image(node[k + 1]) - image(node[0]);
    }
    const double cell = from.determinant() / 6;
    if (!(cell > 1e-15 * volume)) continue;
    const Mat3 j = to * from.inverse();
    const double det = j.determinant(), root = std::cbrt(det);
    const double logarithm = std::log(det * volume / (4 * std::numbers::pi / 3));
    sum += cell / volume * (j.squaredNorm() / (3 * root * root) + weight * logarithm * logarithm);
  }
  return sum;
}

TEST(Balanced, EnergyIsTheSumOverCells) {
  BalanceOptions options;
  options.volumeWeight = 0.2;
  options.rounds = 2;
  const SphereMap start = radialSphereMap(chart().green().shape());
  const BalancedMap map = balanceMap(chart(), start, nullptr, options);
  EXPECT_NEAR(map.before, energyOf(chart(), start.directions, {}, 0.2), 1e-9);
  // The turn at the end changes nothing; the first knot of the radius may have been lowered.
  EXPECT_NEAR(map.after, energyOf(chart(), map.sphere.directions, map.radius, 0.2), 1e-6);
  EXPECT_LT(map.after, map.before - 0.1);
}

TEST(Balanced, BeatsTheOtherChoicesAtItsOwnMeasure) {
  const BalancedMap balanced = balanceMap(chart(), fieldLines(), nullptr);
  EXPECT_EQ(balanced.sphere.kind, SphereMapKind::balanced);
  EXPECT_EQ(balanced.sphere.flips, 0u);
  EXPECT_EQ(balanced.radius.kind(), RadiusKind::balanced);
  const StarShape& shape = chart().green().shape();
  for (const SphereMap& sphere : {fieldLines(), radialSphereMap(shape), conformalSphereMap(shape)}) {
    for (const RadiusKind kind : {RadiusKind::green, RadiusKind::volume, RadiusKind::mixed}) {
      const double other =
          energyOf(chart(), sphere.directions, radiusProfile(kind, chart().foliation()), 0.03);
      EXPECT_LT(balanced.after, other) << toString(sphere.kind) << ", " << toString(kind);
    }
  }
}

TEST(Balanced, DoesNotDependOnTheStart) {
  BalanceOptions options;
  options.rounds = 12;
  options.stepsPerRound = 40;
  const StarShape& shape = chart().green().shape();
  const BalancedMap a = balanceMap(chart(), fieldLines(), nullptr, options);
  const BalancedMap b = balanceMap(chart(), radialSphereMap(shape), nullptr, options);
  EXPECT_NEAR(a.after, b.after, 1e-5);
  double apart = 0;
  for (std::size_t i = 0; i < a.sphere.directions.size(); ++i)
    apart = std::max(apart, (a.sphere.directions[i] - b.sphere.directions[i]).norm());
  EXPECT_LT(apart, 0.01);  // an edge is 0.15
}

TEST(Balanced, LeavesABallAlone) {
  const GreenChart ball = traceChart(solveGreen(testing::starShape(icosphere(3), Vec3(0, 0, 0))));
  const BalancedMap map =
      balanceMap(ball, fieldLineSphereMap(ball.green().shape(), ball.directions()), nullptr);
  EXPECT_NEAR(map.after, 1, 0.01);
  EXPECT_LE(map.after, map.before);
  const std::vector<Vec3>& v = ball.green().shape().mesh().vertices;
  for (std::size_t i = 0; i < v.size(); ++i)
    EXPECT_LT((map.sphere.directions[i] - v[i].normalized()).norm(), 0.02);
  for (const double r : {0.2, 0.5, 0.8}) EXPECT_NEAR(map.radius.value(r), r, 0.03);
}

TEST(Balanced, KeepsWhatIsFixed) {
  const RadiusProfile mixed = radiusProfile(RadiusKind::mixed, chart().foliation());
  const BalancedMap sphereAlone = balanceMap(chart(), fieldLines(), &mixed);
  EXPECT_EQ(sphereAlone.radius.kind(), RadiusKind::mixed);
  EXPECT_EQ(sphereAlone.radius.value(0.37), mixed.value(0.37));
  EXPECT_LT(sphereAlone.after, sphereAlone.before);

  BalanceOptions options;
  options.rounds = 0;
  const SphereMap start = fieldLines();
  const BalancedMap radiusAlone = balanceMap(chart(), start, nullptr, options);
  EXPECT_TRUE(radiusAlone.sphere.directions == start.directions);
  EXPECT_EQ(radiusAlone.sphere.kind, SphereMapKind::fieldLine);
  EXPECT_LT(radiusAlone.after, radiusAlone.before);
}

TEST(Balanced, DoesNotMoveAMapWithFlips) {
  SphereMap flipped = fieldLines();
  std::swap(flipped.directions[3], flipped.directions[40]);
  flipped.flips = countFlips(flipped.directions, chart().foliation().triangles);
  ASSERT_GT(flipped.flips, 0u);
  const BalancedMap map = balanceMap(chart(), flipped, nullptr);
  EXPECT_TRUE(map.sphere.directions == flipped.directions);
  EXPECT_EQ(map.sphere.kind, SphereMapKind::fieldLine);
}

TEST(Balanced, NoiseInAFewColumnsLeavesTheRestAlone) {
  auto data = std::make_shared<GreenChart::Data>(
      GreenChart::Data{chart().green(),
                       chart().foliation(),
                       {chart().harmonic().begin(), chart().harmonic().end()},
                       {chart().harmonicGradient().begin(), chart().harmonicGradient().end()},
                       {chart().directions().begin(), chart().directions().end()},
                       {},
                       {},
                       chart().report()});
  Foliation& f = data->foliation;
  const std::int32_t spoiled = 17;
  for (std::size_t level = 4; level < 9; ++level) f.nodes[f.nodeId(level, spoiled)] = -f.node(level, spoiled);
  data->report.cells = countCells(f);
  ASSERT_GT(data->report.cells.bad(), 5u);
  const BalancedMap noisy = balanceMap(GreenChart(data), fieldLines(), nullptr);
  const BalancedMap clean = balanceMap(chart(), fieldLines(), nullptr);
  EXPECT_EQ(noisy.sphere.flips, 0u);
  for (std::size_t i = 0; i < clean.sphere.directions.size(); ++i)
    EXPECT_LT((noisy.sphere.directions[i] - clean.sphere.directions[i]).norm(), 0.05)
        << i;  // an edge is 0.15
  for (const double r : {0.3, 0.6, 0.9}) EXPECT_NEAR(noisy.radius.value(r), clean.radius.value(r), 0.01);
}

TEST(Balanced, SameBytesForAnyNumberOfThreads) {
  std::vector<BalancedMap> results;
  for (const int threads : {1, 3})
    withThreads(threads, [&] { results.push_back(balanceMap(chart(), fieldLines(), nullptr)); });
  EXPECT_TRUE(results[0].sphere.directions == results[1].sphere.directions);
  EXPECT_EQ(results[0].radius.value(0.5), results[1].radius.value(0.5));
}

TEST(Balanced, ChecksItsOptions) {
  BalanceOptions options;
  options.volumeWeight = -1;
  EXPECT_THROW(balanceMap(chart(), fieldLines(), nullptr, options), Error);
}

}  // namespace
}  // namespace polestar
