#include "polestar/polycube/detail/heaviest_closure.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

namespace polestar::detail {
namespace {

/// Every star-shaped set of the cells of a small box, one bit a cell.
std::vector<std::uint32_t> allStarShapedSets(const CellBox& box) {
  std::vector<std::pair<std::size_t, std::size_t>> needs;  // cell, neighbour towards the center
  Cell c;
  for (c[0] = box.min[0]; c[0] <= box.max[0]; ++c[0]) {
    for (c[1] = box.min[1]; c[1] <= box.max[1]; ++c[1]) {
      for (c[2] = box.min[2]; c[2] <= box.max[2]; ++c[2]) {
        for (int axis = 0; axis < 3; ++axis) {
          if (c[axis] == 0) continue;
          Cell inner = c;
          inner[axis] -= c[axis] > 0 ? 1 : -1;
          needs.emplace_back(box.index(c), box.index(inner));
        }
      }
    }
  }
  const std::uint32_t center = 1u << box.index({0, 0, 0});
  std::vector<std::uint32_t> sets;
  for (std::uint32_t set = 0; set < 1u << box.size(); ++set) {
    bool closed = (set & center) != 0;
    for (const auto& [cell, inner] : needs) closed = closed && (!(set >> cell & 1) || (set >> inner & 1));
    if (closed) sets.push_back(set);
  }
  return sets;
}

std::uint32_t bits(const std::vector<char>& chosen) {
  std::uint32_t set = 0;
  for (std::size_t i = 0; i < chosen.size(); ++i) set |= static_cast<std::uint32_t>(chosen[i]) << i;
  return set;
}

const CellBox kSmallBox{{-1, -1, 0}, {1, 1, 1}};  // 18 cells

TEST(HeaviestClosure, IsTheSmallestHeaviestOfAllSets) {
  const std::vector<std::uint32_t> sets = allStarShapedSets(kSmallBox);
  ASSERT_GT(sets.size(), 500u);
  std::mt19937 random(1);
  for (int trial = 0; trial < 60; ++trial) {
    // Few different weights, so that many sets weigh the same.
    std::uniform_int_distribution<std::int64_t> any(trial % 2 ? -3 : -1000, trial % 3 ? 2 : 900);
    std::vector<std::int64_t> weight(kSmallBox.size());
    for (std::int64_t& w : weight) w = any(random);
    std::int64_t heaviest = INT64_MIN;
    std::uint32_t smallest = 0;  // sets of largest weight have an intersection that is one of them
    for (const std::uint32_t set : sets) {
      std::int64_t sum = 0;
      for (std::size_t i = 0; i < weight.size(); ++i) sum += set >> i & 1 ? weight[i] : 0;
      if (sum > heaviest) heaviest = sum, smallest = set;
      if (sum == heaviest) smallest &= set;
    }
    EXPECT_EQ(bits(heaviestClosure(kSmallBox, weight)), smallest) << trial;
  }
}

TEST(HeaviestClosure, KeepsTheCenterWhateverItCosts) {
  std::vector<std::int64_t> weight(kSmallBox.size(), -5);
  EXPECT_EQ(bits(heaviestClosure(kSmallBox, weight)), 1u << kSmallBox.index({0, 0, 0}));
}

TEST(HeaviestClosure, ATreasureIsWorthItsWay) {
  const CellBox row{{0, 0, 0}, {9, 0, 0}};
  std::vector<std::int64_t> weight(10, -1);
  weight[9] = 9;
  EXPECT_EQ(heaviestClosure(row, weight), std::vector<char>(10, 1));
  weight[9] = 8;  // as much as the way costs: the smallest set stays at home
  EXPECT_EQ(bits(heaviestClosure(row, weight)), 1u);
}

TEST(BestOverlap, IsTheBestOfAllSets) {
  const std::vector<std::uint32_t> sets = allStarShapedSets(kSmallBox);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 60; ++trial) {
    CellVolumes volumes{kSmallBox, {}, {}, 0};
    for (std::size_t i = 0; i < kSmallBox.size(); ++i) {
      volumes.all.push_back(0.8 + 0.4 * uniform(random));
      volumes.inside.push_back(volumes.all.back() * uniform(random));
      volumes.solid += volumes.inside.back();
    }
    volumes.solid += trial % 3;  // some of it beyond the box
    const auto overlapOf = [&](std::uint32_t set) {
      double shared = 0, outside = 0;
      for (std::size_t i = 0; i < kSmallBox.size(); ++i) {
        if (!(set >> i & 1)) continue;
        shared += volumes.inside[i];
        outside += volumes.all[i] - volumes.inside[i];
      }
      return shared / (volumes.solid + outside);
    };
    double best = 0;
    for (const std::uint32_t set : sets) best = std::max(best, overlapOf(set));
    const BestOverlap found = bestOverlap(volumes);
    EXPECT_NEAR(found.overlap, best, 1e-10) << trial;
    EXPECT_NEAR(overlapOf(bits(found.chosen)), best, 1e-10) << trial;
    EXPECT_LE(found.cuts, 8);
  }
}

}  // namespace
}  // namespace polestar::detail
