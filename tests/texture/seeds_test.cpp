#include "polestar/texture/detail/seeds.h"

#include <gtest/gtest.h>

#include <map>

#include "support.h"

namespace polestar::detail {
namespace {

SeedLayout layout(bool thinning) {
  SeedLayout result;
  result.thinning = thinning;
  result.presence = 1;
  return result;
}

TEST(Seeds, AreSolidDropsOfTheirSize) {
  // Volume of one seed from random points: that of the drop, 4/3 pi abc (1 + small), at a known count.
  for (const bool thinning : {false, true}) {
    const SeedLayout seeds = layout(thinning);
    std::map<std::uint32_t, int> hits;
    const auto points = testing::randomBallPoints(400000, 1);
    for (const Vec3& p : points) {
      const Seed seed = seedNear(VaryingPoint(p), Footprint(Mat3::Zero()), seeds);
      if (seed.present && seed.form.value < 1) ++hits[seed.hash];
    }
    const double volume = 4 / 3.0 * M_PI * seeds.length * seeds.width * seeds.thickness / 8 * 0.58;
    const double expected = 400000 * volume / (4 / 3.0 * M_PI);
    double sum = 0;
    for (const auto& [hash, count] : hits) sum += count;
    EXPECT_NEAR(sum / static_cast<double>(hits.size()) / expected, 1, 0.15) << thinning;
    EXPECT_GT(hits.size(), 150u) << thinning;
  }
}

TEST(Seeds, AreNotCutOffByTheirCells) {
  // Over small steps into all directions, also across cells, the form of a seed changes by little.
  for (const bool thinning : {false, true}) {
    const SeedLayout seeds = layout(thinning);
    const Footprint point(Mat3::Zero());
    const auto directions = testing::randomDirections(150000, 4);
    std::size_t next = 0;
    int cut = 0, inside = 0;
    for (const Vec3& p : testing::randomBallPoints(150000, 2)) {
      const Vec3 q = p + 2e-4 * directions[next++];
      const Seed one = seedNear(VaryingPoint(p), point, seeds),
                 other = seedNear(VaryingPoint(q), point, seeds);
      if (!one.present || one.form.value > 1) continue;
      ++inside;
      cut += !other.present || std::abs(other.form.value - one.form.value) > 0.1;
    }
    EXPECT_GT(inside, 500) << thinning;
    EXPECT_LE(cut, inside / 100) << thinning;
  }
}

TEST(Seeds, PointAtTheAxisWithTheirTips) {
  const SeedLayout seeds = layout(false);
  double inner = 0, outer = 0;
  for (const Vec3& p : testing::randomBallPoints(200000, 3)) {
    const Seed seed = seedNear(VaryingPoint(p), Footprint(Mat3::Zero()), seeds);
    if (!seed.present || seed.form.value > 1) continue;
    (seed.along < 0 ? inner : outer) += 1;
  }
  EXPECT_GT(outer, 1.5 * inner);
}

}  // namespace
}  // namespace polestar::detail
