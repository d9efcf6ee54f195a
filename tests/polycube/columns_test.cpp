#include "polestar/polycube/detail/columns.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "polestar/core/context.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/reach.h"
#include "support/solids.h"

namespace polestar::detail {
namespace {

using polestar::testing::starShape;

double cubed(double t) { return t * t * t; }

TEST(Columns, WalkThroughTheCellsInOrder) {
  const Vec3 direction(1, 0.31, -0.73);  // meets no two planes at once
  double before = 0;
  walkCells(direction, 7.25, [&](const Cell& cell, double begin, double end) {
    EXPECT_EQ(begin, before);
    const Vec3 middle = 0.5 * (begin + end) * direction;
    for (int k = 0; k < 3; ++k) EXPECT_EQ(cell[k], std::lround(middle[k]));
    before = end;
    return true;
  });
  EXPECT_EQ(before, 7.25);
}

TEST(Columns, MeasureCubesExactlyAndCellsClosely) {
  const ColumnRule rule(64);
  const CellMeasure measure(rule, 3);
  // A cube about the center of 3.6 cells a side.
  const std::vector<double> lengths(rule.size(), 1.8);
  const CellBox box{{-3, -3, -3}, {3, 3, 3}};
  const CellVolumes volumes = measure.volumes(rule, lengths, 1, box);
  EXPECT_NEAR(volumes.solid, cubed(3.6), 1e-9);
  double inside = 0;
  for (const double v : volumes.inside) inside += v;
  EXPECT_NEAR(inside, volumes.solid, 1e-9);
  for (const double v : volumes.all) EXPECT_NEAR(v, 1, 0.1);
  EXPECT_NEAR(volumes.inside[box.index({2, 0, 0})], 0.3, 0.01);
  EXPECT_NEAR(volumes.inside[box.index({-2, 2, 0})], 0.09, 0.01);
  EXPECT_NEAR(volumes.inside[box.index({1, -1, 1})], volumes.all[box.index({1, -1, 1})], 1e-12);
  EXPECT_EQ(volumes.inside[box.index({3, 0, 0})], 0);
}

TEST(Columns, TheTableFindsTheSurface) {
  const StarShape shape = starShape(smoothStar(5), Vec3::Zero());
  const ReachTable table(shape, Context::quiet());
  const ExactReach exact(shape);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 direction(normal(random), normal(random), normal(random));
    worst = std::max(worst, std::abs(table.reach(direction) / exact.reach(direction) - 1));
  }
  EXPECT_LT(worst, 1e-3);
  // Along the axes, in every direction, the surface is known.
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const Vec3 u = sign * Vec3::Unit(k);
      const double radius = (1 + 0.3 * u[2] * (u[0] * u[0] * u[0] - 3 * u[0] * u[1] * u[1]));
      EXPECT_NEAR(exact.reach(3 * u) * shape.frame().unit, radius, 2e-3);
      EXPECT_NEAR(table.reach(3 * u), exact.reach(u), 1e-12);
    }
  }
}

TEST(BestScale, IsTheBestOfAll) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0.5, 2);
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<double> fixed, scaled;
    for (int i = 0; i < 50; ++i) fixed.push_back(3 * uniform(random)), scaled.push_back(uniform(random));
    const auto overlapAt = [&](double scale) {
      double both = 0, either = 0;
      for (std::size_t i = 0; i < fixed.size(); ++i) {
        both += cubed(std::min(fixed[i], scale * scaled[i]));
        either += cubed(std::max(fixed[i], scale * scaled[i]));
      }
      return both / either;
    };
    double best = 0;
    for (double scale = 0.5; scale < 15; scale *= 1.0001) best = std::max(best, overlapAt(scale));
    const BestScale found = bestScale(fixed, scaled);
    EXPECT_NEAR(found.overlap, overlapAt(found.scale), 1e-12);
    EXPECT_GE(found.overlap, best - 1e-12);
    EXPECT_LT(found.overlap, best + 1e-3);
  }
}

}  // namespace
}  // namespace polestar::detail
