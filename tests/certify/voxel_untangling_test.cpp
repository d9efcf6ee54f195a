#include "polestar/certify/voxel_untangling.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "voxel_lattice.h"

namespace polestar {
namespace {

using testing::kSize;
using testing::Lattice;

std::vector<char> nothingIsOutside(std::span<const Vec3> places) {
  return std::vector<char>(places.size(), 0);
}

std::size_t invertedDeep(const Lattice& lattice, const MendedBlock& mended) {
  VoxelBlock block = lattice.block();
  block.rest = mended.rest;
  return judgeCells(block).invertedDeep;
}

// A half-space folded open around a reentrant edge along z, as the power 3/2 does: angles grow by half,
// distances shrink towards the edge. Samples are off by `noise` voxels.
Lattice reentrantEdge(double noise) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> off(-noise, noise);
  Lattice lattice([&](const Vec3& x) {
    const double along = x[0] + 0.5 * kSize + 0.3, across = x[1] + 0.2;
    const double angle = 1.5 * std::atan2(across, along),
                 length = 0.3 * std::pow(std::hypot(along, across), 1.5);
    return Vec3(length * std::cos(angle) + off(random), length * std::sin(angle) + off(random),
                x[2] + off(random));
  });
  return lattice;
}

TEST(VoxelUntangling, MendsCellsBesideAReentrantEdge) {
  const Lattice lattice = reentrantEdge(0.28);
  const CellQuality before = judgeCells(lattice.block());
  ASSERT_GT(before.invertedDeep, 10u);
  std::size_t rim = 0;  // cells that nothing may be moved for
  for (const auto& cell : deepInvertedCells(lattice.block())) {
    const auto [low, high] = std::minmax_element(cell.begin(), cell.end());
    rim += *low < 2 || *high + 1 >= kSize - 2;
  }
  const MendedBlock mended = untangleInvertedCells(lattice.block(), nothingIsOutside);
  EXPECT_LE(invertedDeep(lattice, mended), rim) << "out of reach";
  EXPECT_LT(mended.largestMove, 0.5);
  std::size_t next = 0;
  for (std::size_t i = 0; i < lattice.rest.size(); ++i) {
    if (next < mended.moved.size() && mended.moved[next] == i) {
      ++next;
    } else {
      EXPECT_EQ(mended.rest[i], lattice.rest[i]);
    }
  }
  EXPECT_EQ(next, mended.moved.size());
}

// One sample far inside that went past its neighbours comes back; nobody else needs to move.
Lattice oneBeyond() {
  Lattice lattice([](const Vec3& x) { return Vec3(x[0] + 0.3 * x[1], x[1] - 0.2 * x[2], x[2]); });
  lattice.rest[Lattice::at(11, 12, 13)] += Vec3f(1.4F, 0.2F, 0);
  return lattice;
}

TEST(VoxelUntangling, BringsBackOneSample) {
  const Lattice lattice = oneBeyond();
  ASSERT_GT(judgeCells(lattice.block()).invertedDeep, 0u);
  const MendedBlock mended = untangleInvertedCells(lattice.block(), nothingIsOutside);
  EXPECT_EQ(invertedDeep(lattice, mended), 0u);
  EXPECT_LE(mended.moved.size(), 27u) << "the corners of the cells that were inverted";
}

TEST(VoxelUntangling, SamplesDoNotLeaveTheDomain) {
  // The domain ends right behind the sample: it may not come back.
  const Lattice lattice = oneBeyond();
  const double rim = lattice.rest[Lattice::at(11, 12, 13)].x() - 1e-3;
  const MendedBlock mended = untangleInvertedCells(lattice.block(), [&](std::span<const Vec3> places) {
    std::vector<char> outside;
    for (const Vec3& place : places) outside.push_back(place.x() < rim);
    return outside;
  });
  for (const std::size_t sample : mended.moved) EXPECT_GE(mended.rest[sample].x(), rim);
  // Outside of the solid nothing has to lie in the domain.
  Lattice beyond = lattice;
  for (int i = 0; i < kSize; ++i) beyond.distance[Lattice::at(i, 12, 13)] = 0.5F;
  const MendedBlock free = untangleInvertedCells(
      beyond.block(), [&](std::span<const Vec3> places) { return std::vector<char>(places.size(), 1); });
  EXPECT_TRUE(free.moved.empty()) << "its cells are not deep any more";
}

TEST(VoxelUntangling, AFoldStaysAFold) {
  const Lattice lattice(
      [](const Vec3& x) { return Vec3(x[0], std::abs(x[1] - 3) < 6 ? 6 - x[1] : x[1], x[2]); });
  ASSERT_GT(judgeCells(lattice.block()).invertedDeep, 0u);
  EXPECT_TRUE(untangleInvertedCells(lattice.block(), nothingIsOutside).moved.empty());
  // One that ends within the block could be undone, by moving samples several voxels.
  const Lattice local(
      [](const Vec3& x) { return Vec3(x[0], x[1] - 6 * x[1] * std::exp(-x.squaredNorm() / 6), x[2]); });
  ASSERT_GT(judgeCells(local.block()).invertedDeep, 0u);
  EXPECT_TRUE(untangleInvertedCells(local.block(), nothingIsOutside).moved.empty());
}

TEST(VoxelUntangling, LeavesAloneWhatItCannotOrNeedNotReach) {
  const Lattice good([](const Vec3& x) { return Vec3(x[0] + 0.3 * x[1], x[1], x[2]); });
  EXPECT_TRUE(untangleInvertedCells(good.block(), nothingIsOutside).moved.empty());
  Lattice corner = good;
  corner.rest[0] = Vec3f(30, 30, 0);
  ASSERT_GT(judgeCells(corner.block()).invertedDeep, 0u);
  EXPECT_TRUE(untangleInvertedCells(corner.block(), nothingIsOutside).moved.empty());
}

}  // namespace
}  // namespace polestar
