#include "polestar/certify/voxel_filter.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <cmath>

#include "voxel_lattice.h"

namespace polestar {
namespace {

using testing::kSize;
using testing::Lattice;

// Far from the origin, where radii hardly differ from x: so that only directions matter.
Vec3 far(double y, double z, double x) { return {10 + 0.1 * x, 0.1 * y, 0.1 * z}; }

// One to one, with a derivative that grows without bound towards an oblique sheet, as below a sharp edge:
// cells that it crosses alias. It fades along x.
Vec3 sheet(const Vec3& x) {
  const double s = x[1] + 0.25 * x[2];
  const double jump = std::copysign(std::sqrt(std::abs(s)), s) * std::exp(-s * s / 18);
  return far(s + 0.9 * std::exp(-x[0] * x[0] / 8) * jump, x[2] + 3 * x[1], x[0]);
}

// The sheet leaves the block; only what lies nearer to the middle counts as deep.
Lattice sheetLattice() {
  Lattice lattice(sheet);
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) {
      for (int k = 0; k < kSize; ++k) {
        if (std::abs(k - kSize / 2) > 5) lattice.distance[(i * kSize + j) * kSize + k] = -0.5F;
      }
    }
  }
  return lattice;
}

double smallestJacobian(const std::function<Vec3(const Vec3&)>& map) {
  double smallest = 1e300;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) {
      for (int k = 0; k < 40; ++k) {
        const Vec3 x = 0.5 * Vec3(i, j, k) - Vec3(9.871, 9.913, 9.727);
        Mat3 derivative;
        for (int a = 0; a < 3; ++a) {
          const Vec3 step = 1e-4 * Vec3::Unit(a);
          derivative.col(a) = (map(x + step) - map(x - step)) / 2e-4;
        }
        smallest = std::min(smallest, derivative.determinant());
      }
    }
  }
  return smallest;
}

TEST(VoxelFilter, MendsCellsThatASheetCrosses) {
  const Lattice lattice = sheetLattice();
  const CellQuality before = judgeCells(lattice.block());
  ASSERT_GT(before.invertedDeep, 0u);
  const MendedBlock filtered = filterInvertedCells(lattice.block());
  VoxelBlock after = lattice.block();
  after.rest = filtered.rest;
  EXPECT_EQ(judgeCells(after).invertedDeep, 0u);
  EXPECT_LE(judgeCells(after).inverted, before.inverted);
  EXPECT_FALSE(filtered.moved.empty());
  EXPECT_LT(filtered.moved.size(), lattice.rest.size() / 4);
  EXPECT_LT(filtered.largestMove, 0.2);  // two voxels' steps

  std::size_t next = 0;
  for (std::size_t i = 0; i < lattice.rest.size(); ++i) {
    if (next < filtered.moved.size() && filtered.moved[next] == i) {
      ++next;
      EXPECT_NEAR(filtered.rest[i].norm(), lattice.rest[i].norm(), 2e-6);
    } else {
      EXPECT_EQ(filtered.rest[i], lattice.rest[i]);
    }
  }
  EXPECT_EQ(next, filtered.moved.size());
}

TEST(VoxelFilter, LeavesGoodCellsAlone) {
  const Lattice lattice([](const Vec3& x) { return far(x[1] + 0.3 * x[2], x[2] - 0.2 * x[0], x[0]); });
  const MendedBlock filtered = filterInvertedCells(lattice.block());
  EXPECT_TRUE(filtered.moved.empty());
  EXPECT_EQ(filtered.rest, lattice.rest);
}

TEST(VoxelFilter, AFoldStaysAFold) {
  const Lattice lattice(
      [](const Vec3& x) { return far(std::abs(x[1] - 3) < 6 ? 3 - (x[1] - 3) : x[1], x[2], x[0]); });
  const MendedBlock filtered = filterInvertedCells(lattice.block());
  EXPECT_TRUE(filtered.moved.empty());
  EXPECT_EQ(filtered.rest, lattice.rest);
}

TEST(VoxelFilter, TouchesNothingNearTheBlocksEdge) {
  Lattice lattice([](const Vec3& x) { return far(x[1], x[2], x[0]); });
  lattice.rest[0] = far(20, 20, 0).cast<float>();  // its cells are inverted, and cannot be reached
  ASSERT_GT(judgeCells(lattice.block()).invertedDeep, 0u);
  EXPECT_TRUE(filterInvertedCells(lattice.block()).moved.empty());
}

TEST(VoxelFilter, FindsTheCells) {
  Lattice lattice([](const Vec3& x) { return far(x[1], x[2], x[0]); });
  EXPECT_TRUE(deepInvertedCells(lattice.block()).empty());
  // A sample beyond its neighbours turns the cells around it over, some of the eight.
  lattice.rest[(7 * kSize + 8) * kSize + 9] = far(8 + 1.6 - 11.5, 9 - 11.5, 7 - 11.5).cast<float>();
  const auto found = deepInvertedCells(lattice.block());
  EXPECT_EQ(found.size(), judgeCells(lattice.block()).invertedDeep);
  ASSERT_FALSE(found.empty());
  for (const auto& cell : found) {
    EXPECT_TRUE(cell[0] == 6 || cell[0] == 7);
    EXPECT_TRUE(cell[1] == 7 || cell[1] == 8);
    EXPECT_TRUE(cell[2] == 8 || cell[2] == 9);
  }
}

TEST(VoxelFilter, TheSheetOfTheseTestsIsOneToOne) { EXPECT_GT(smallestJacobian(sheet), 0); }

}  // namespace
}  // namespace polestar
