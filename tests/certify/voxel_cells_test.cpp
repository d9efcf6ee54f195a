#include "polestar/certify/voxel_cells.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <functional>
#include <random>
#include <vector>

namespace polestar {
namespace {

// A lattice of n^3 samples of a map, all of it inside the solid, `depth` below the surface.
struct Lattice {
  int n;
  double voxel;
  std::vector<Vec3f> rest;
  std::vector<float> distance;
  std::vector<std::uint8_t> active;

  Lattice(int size, double voxelSize, const std::function<Vec3(const Vec3&)>& map, double depth = 100)
      : n(size),
        voxel(voxelSize),
        distance(size * size * size, static_cast<float>(-depth)),
        active(size * size * size, 1) {
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < n; ++k) rest.push_back(map(voxel * Vec3(i, j, k)).cast<float>());
      }
    }
  }
  CellQuality judge() const { return judgeCells({n, rest, distance, active, voxel}); }
  int at(int i, int j, int k) const { return (i * n + j) * n + k; }
};

TEST(VoxelCells, AnAffineMapHasItsDeterminantEverywhere) {
  Mat3 a;
  a << 0.5, 0.1, 0, -0.2, 0.4, 0.1, 0, 0.3, 0.6;
  const CellQuality q = Lattice(9, 0.25, [&](const Vec3& x) { return Vec3(a * x); }).judge();
  EXPECT_EQ(q.voxels, 512u);
  EXPECT_EQ(q.cells, 512u);
  EXPECT_EQ(q.inverted + q.collapsed, 0u);
  EXPECT_NEAR(q.minJacobian, a.determinant(), 1e-5);
}

TEST(VoxelCells, AMirrorInvertsThemAll) {
  const CellQuality q = Lattice(5, 1, [](const Vec3& x) { return Vec3(-x[0], x[1], x[2]); }).judge();
  EXPECT_EQ(q.inverted, q.cells);
  EXPECT_EQ(q.invertedDeep, q.cells);
}

TEST(VoxelCells, AFoldIsFoundWhereItIs) {
  // x turns back at 3.5: cells between samples 3 and 4 are flat, beyond they are inverted.
  const CellQuality q =
      Lattice(9, 1, [](const Vec3& x) { return Vec3(3.5 - std::abs(x[0] - 3.5), x[1], x[2]); }).judge();
  EXPECT_EQ(q.cells, 512u);
  EXPECT_EQ(q.collapsed, 64u);
  EXPECT_EQ(q.inverted, 256u);
}

TEST(VoxelCells, ShallowOnesAreCountedApart) {
  const auto mirror = [](const Vec3& x) { return Vec3(-x[0], x[1], x[2]); };
  EXPECT_EQ(Lattice(3, 1, mirror, 0.9).judge().invertedDeep, 0u);
  EXPECT_EQ(Lattice(3, 1, mirror, 1.1).judge().invertedDeep, 8u);
}

TEST(VoxelCells, OnlyCellsWhollyInsideCount) {
  Lattice lattice(3, 1, [](const Vec3& x) { return x; });
  lattice.distance[lattice.at(0, 0, 0)] = 0.1f;
  lattice.active[lattice.at(2, 2, 2)] = 0;
  const CellQuality q = lattice.judge();
  EXPECT_EQ(q.cells, 6u);
  EXPECT_EQ(q.voxels, 7u);
}

// Smallest det J of the trilinear interpolant over a fine lattice of points.
double sampledMinimum(const std::array<Vec3, 8>& c) {
  constexpr int kSteps = 12;
  double smallest = 1e300;
  for (int a = 0; a <= kSteps; ++a) {
    for (int b = 0; b <= kSteps; ++b) {
      for (int d = 0; d <= kSteps; ++d) {
        const double t[3] = {a / double(kSteps), b / double(kSteps), d / double(kSteps)};
        Mat3 jacobian = Mat3::Zero();
        for (int q = 0; q < 8; ++q) {
          const int bit[3] = {q >> 2, q >> 1 & 1, q & 1};
          for (int axis = 0; axis < 3; ++axis) {
            double weight = bit[axis] ? 1 : -1;
            for (int other = 0; other < 3; ++other) {
              if (other != axis) weight *= bit[other] ? t[other] : 1 - t[other];
            }
            jacobian.col(axis) += weight * c[q];
          }
        }
        smallest = std::min(smallest, jacobian.determinant());
      }
    }
  }
  return smallest;
}

TEST(VoxelCells, VerdictsAgreeWithDenseSamplingOnRandomCells) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  int good = 0, bad = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const double noise = 0.05 + 0.35 * trial / 3000;
    Lattice lattice(2, 1, [&](const Vec3& x) {
      return Vec3(x + noise * Vec3(normal(random), normal(random), normal(random)));
    });
    std::array<Vec3, 8> corner;
    for (int q = 0; q < 8; ++q) corner[q] = lattice.rest[q].cast<double>();
    const double smallest = sampledMinimum(corner);
    const CellQuality quality = lattice.judge();
    ASSERT_EQ(quality.cells, 1u);
    if (smallest < 0) {
      EXPECT_EQ(quality.inverted, 1u) << "sampled minimum " << smallest;
      ++bad;
    } else if (smallest > 0.02) {  // clearly positive: the subdivision must see it
      EXPECT_EQ(quality.inverted, 0u) << "sampled minimum " << smallest;
      ++good;
    }
  }
  EXPECT_GT(good, 300);
  EXPECT_GT(bad, 300);
}

}  // namespace
}  // namespace polestar
