#include "polestar/certify/voxel_cells.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "support/exact.h"

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
  EXPECT_EQ(q.collapsedDeep, 64u);
  EXPECT_EQ(q.inverted, 256u);
}

TEST(VoxelCells, ShallowOnesAreCountedApart) {
  const auto mirror = [](const Vec3& x) { return Vec3(-x[0], x[1], x[2]); };
  EXPECT_EQ(Lattice(3, 1, mirror, 0.9).judge().invertedDeep, 0u);
  EXPECT_EQ(Lattice(3, 1, mirror, 1.1).judge().invertedDeep, 8u);
  const auto flat = [](const Vec3& x) { return Vec3(0, x[1], x[2]); };
  EXPECT_EQ(Lattice(3, 1, flat, 0.9).judge().collapsed, 8u);
  EXPECT_EQ(Lattice(3, 1, flat, 0.9).judge().collapsedDeep, 0u);
  EXPECT_EQ(Lattice(3, 1, flat, 1.1).judge().collapsedDeep, 8u);
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
  constexpr int kSteps = 16;  // every point that four subdivisions a side look at
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
  int good = 0, bad = 0, undecided = 0;
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
    EXPECT_LE(quality.undecided, quality.inverted);
    undecided += static_cast<int>(quality.undecided);
    if (quality.undecided < quality.inverted) {
      EXPECT_LT(smallest, 0) << "refuted by a negative value, and there is none";
    }
  }
  EXPECT_GT(good, 300);
  EXPECT_GT(bad, 300);
  EXPECT_LT(undecided, 30);
}

// Floats with 24 bits whose cell is affine, du and dv random, dw a whole combination of them: flat, but for
// `units` in its third corner.
std::array<Vec3, 8> nearlyFlatCell(std::mt19937& random, int units) {
  std::uniform_int_distribution<int> coordinate(-(1 << 18), 1 << 18), factor(-7, 7);
  const auto edge = [&] { return Vec3(coordinate(random), coordinate(random), coordinate(random)); };
  const Vec3 origin = edge(), du = edge(), dv = edge();
  Vec3 dw = factor(random) * du + factor(random) * dv;
  dw[coordinate(random) & 1 ? 2 : 0] += units;
  std::array<Vec3, 8> corners;
  for (int q = 0; q < 8; ++q)
    corners[q] = 0x1p-24 * (origin + (q >> 2) * du + (q >> 1 & 1) * dv + (q & 1) * dw);
  return corners;
}

CellQuality judgeOne(const std::array<Vec3, 8>& corners) {
  Lattice lattice(2, 1, [&](const Vec3& x) {
    return corners[4 * static_cast<int>(x[0]) + 2 * static_cast<int>(x[1]) + static_cast<int>(x[2])];
  });
  return lattice.judge();
}

int exactSign(const std::array<Vec3, 8>& c) {
  using testing::difference, testing::exact;
  return testing::determinant(difference(exact(c[4]), exact(c[0])), difference(exact(c[2]), exact(c[0])),
                              difference(exact(c[1]), exact(c[0])))
      .sign();
}

TEST(VoxelCells, SignsAreExactWhereRoundingHasTheLastWord) {
  std::mt19937 random(3);
  int roundedWrong = 0, positive = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    const auto corners = nearlyFlatCell(random, trial % 3 - 1);
    for (const Vec3& corner : corners) ASSERT_EQ(corner.cast<float>().cast<double>(), corner);
    const int sign = exactSign(corners);
    const double rounded =
        (corners[4] - corners[0]).cross(corners[2] - corners[0]).dot(corners[1] - corners[0]);
    roundedWrong += (rounded > 0) - (rounded < 0) != sign;
    const CellQuality quality = judgeOne(corners);
    EXPECT_EQ(quality.collapsed, sign == 0 ? 1u : 0u);
    if (sign < 0) {
      EXPECT_EQ(quality.inverted, 1u);
      EXPECT_EQ(quality.undecided, 0u);
    }
    if (sign > 0) {
      // Shown, or left open: never refuted.
      EXPECT_EQ(quality.inverted, quality.undecided);
      positive += quality.inverted == 0;
    }
  }
  EXPECT_GT(roundedWrong, 100) << "the cells must be hard, or this test shows nothing";
  EXPECT_GT(positive, 100);
}

TEST(VoxelCells, WhatIsNoNumberIsInverted) {
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    for (int axis = 0; axis < 3; ++axis) {
      Lattice lattice(3, 1, [](const Vec3& x) { return x; });
      lattice.rest[lattice.at(1, 1, 1)][axis] = value;
      EXPECT_EQ(lattice.judge().inverted, 8u);
      EXPECT_EQ(lattice.judge().invertedDeep, 8u);
    }
  }
}

}  // namespace
}  // namespace polestar
