#include "polestar/texture/detail/cells.h"

#include <gtest/gtest.h>

#include <map>

#include "polestar/texture/detail/hash.h"
#include "support.h"

namespace polestar::detail {
namespace {

TEST(Cells, NearestAndWallAreThoseOfAllPointsAround) {
  // Against a search of 5^3 cubes. Of the points themselves no more is known than their distance and hash.
  int other = 0;
  for (const Vec3& p : testing::randomPoints(3000, 30, 1)) {
    std::multimap<double, std::pair<std::uint32_t, Vec3>> nearest;
    const Vec3 floor = p.array().floor();
    for (int n = 0; n < 125; ++n) {
      const Vec3 cube = floor + Vec3(n % 5 - 2, n / 5 % 5 - 2, n / 25 - 2);
      const std::uint32_t hash =
          latticeHash(static_cast<int>(cube[0]), static_cast<int>(cube[1]), static_cast<int>(cube[2]), 7);
      const Vec3 point = cube + Vec3(hash & 1023, (hash >> 10) & 1023, (hash >> 20) & 1023) / 1023;
      nearest.emplace((point - p).squaredNorm(), std::pair(hash, point));
    }
    const auto first = nearest.begin(), second = std::next(first);
    const Cell cell = cellAt(VaryingPoint(p), 1, 7);
    EXPECT_EQ(cell.hash[0], scramble(first->second.first));
    EXPECT_NEAR(cell.center.value, std::sqrt(first->first), 1e-5);
    if (cell.hash[1] != scramble(second->second.first)) {
      ++other;  // beyond the 3^3 cubes that are looked at
      continue;
    }
    const Vec3 between = second->second.second - first->second.second;
    const Vec3 middle = (second->second.second + first->second.second) / 2;
    EXPECT_NEAR(cell.walls[0].value, (middle - p).dot(between.normalized()), 1e-4);
    EXPECT_NEAR((cell.walls[0].gradient + between.normalized()).norm(), 0, 1e-4);
  }
  EXPECT_LT(other, 10);
}

TEST(Cells, OnWallsNeighboursChangeRoles) {
  for (const Vec3& p : testing::randomPoints(500, 30, 2)) {
    const Cell cell = cellAt(VaryingPoint(p), 0.8, 3);
    const Vec3 beyond = p - (cell.walls[0].value + 1e-4) * cell.walls[0].gradient;
    const Cell there = cellAt(VaryingPoint(beyond), 0.8, 3);
    // Unless a third cell lies in between.
    if (there.hash[1] == cell.hash[0]) {
      EXPECT_EQ(there.hash[0], cell.hash[1]);
    }
  }
}

TEST(Cells, SharesAreContinuousAcrossWalls) {
  // Of a function of cells, in steps of a fiftieth of the footprint.
  const Footprint footprint(0.2 * Mat3::Identity());
  auto value = [&](const Vec3& p) {
    const Cell cell = cellAt(VaryingPoint(p), 1, 5);
    const auto shares = cell.shares(0, footprint);
    EXPECT_NEAR(shares[0] + shares[1] + shares[2], 1, 1e-12);
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += shares[i] * uniform(cell.hash[i], 1);
    return sum;
  };
  int jumps = 0;
  for (const Vec3& d : testing::randomDirections(20, 3)) {
    double last = value(Vec3::Zero());
    for (int i = 1; i < 2000; ++i) {
      const double next = value(0.004 * i * d);
      jumps += std::abs(next - last) > 0.1;
      last = next;
    }
  }
  // Where four cells meet the fourth is not seen.
  EXPECT_LT(jumps, 40);
}

}  // namespace
}  // namespace polestar::detail
