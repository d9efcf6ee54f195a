#include "voxel_cells.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

namespace polestar::verify {
namespace {

using Polynomial = std::array<double, 27>;  ///< coefficients or values, 9 i + 3 j + k

/// The Jacobian's Bernstein coefficients, from its values on the 3 x 3 x 3 points of the cell, and the size
/// that its rounding is relative to.
struct Jacobian {
  Polynomial bernstein{};
  double scale = 0;

  explicit Jacobian(const CellCorners& c) {
    // Derivatives along each side are bilinear in the two other variables.
    std::array<std::array<Vec3, 9>, 3> along;
    constexpr int kStep[3] = {4, 2, 1};
    scale = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const int s = kStep[(axis + 1) % 3], t = kStep[(axis + 2) % 3];
      double longest = 0;
      const auto edge = [&](int a, int b) {
        const int low = a * s + b * t;
        const Vec3 e = c[static_cast<std::size_t>(low + kStep[axis])] - c[static_cast<std::size_t>(low)];
        longest = std::max(longest, length(e));
        return e;
      };
      const Vec3 e00 = edge(0, 0), e01 = edge(0, 1), e10 = edge(1, 0), e11 = edge(1, 1);
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
          const double p = 0.5 * a, q = 0.5 * b;
          along[static_cast<std::size_t>(axis)][static_cast<std::size_t>(3 * a + b)] =
              (1 - p) * ((1 - q) * e00 + q * e01) + p * ((1 - q) * e10 + q * e11);
        }
      }
      scale *= longest;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) {
          bernstein[9 * i + 3 * j + k] = det(along[0][3 * j + k], along[1][3 * k + i], along[2][3 * i + j]);
        }
      }
    }
    // b0 = f(0), b2 = f(1), b1 such that the parabola passes f(1/2).
    for (const std::size_t stride : {std::size_t{9}, std::size_t{3}, std::size_t{1}}) {
      for (std::size_t i = 0; i < 27; ++i) {
        if (i / stride % 3 != 1) continue;
        bernstein[i] = 2 * bernstein[i] - 0.5 * (bernstein[i - stride] + bernstein[i + stride]);
      }
    }
  }
};

constexpr std::size_t kCorner[8] = {0, 2, 6, 8, 18, 20, 24, 26};

double leastCorner(const Polynomial& b) {
  double least = b[0];
  for (const std::size_t c : kCorner) least = std::min(least, b[c]);
  return least;
}

/// De Casteljau at 1/2.
void halve(const Polynomial& b, std::size_t stride, Polynomial& low, Polynomial& high) {
  for (std::size_t i = 0; i < 27; ++i) {
    if (i / stride % 3 != 0) continue;
    const double b0 = b[i], b1 = b[i + stride], b2 = b[i + 2 * stride];
    const double m0 = 0.5 * (b0 + b1), m1 = 0.5 * (b1 + b2), middle = 0.5 * (m0 + m1);
    low[i] = b0, low[i + stride] = m0, low[i + 2 * stride] = middle;
    high[i] = middle, high[i + stride] = m1, high[i + 2 * stride] = b2;
  }
}

bool isPositive(const Polynomial& b, double tolerance, int halvings) {
  if (std::all_of(b.begin(), b.end(), [&](double x) { return x > tolerance; })) return true;
  if (halvings == 0 || leastCorner(b) <= tolerance) return false;
  constexpr std::size_t kStrides[3] = {9, 3, 1};
  Polynomial low{}, high{};
  halve(b, kStrides[halvings % 3], low, high);
  return isPositive(low, tolerance, halvings - 1) && isPositive(high, tolerance, halvings - 1);
}

/// Whether the cell's image is so thin, in radius or altogether, that floats near 1 cannot tell its corners
/// apart.
bool isCrowded(const CellCorners& rest) {
  constexpr double kThin = 2e-6, kSmall = 2e-5;  // a float near 1 has steps of 6e-8
  double least = 1e300, most = 0, diameter = 0;
  for (const Vec3& v : rest) {
    least = std::min(least, length(v));
    most = std::max(most, length(v));
    diameter = std::max(diameter, length(v - rest[0]));
  }
  return most - least < kThin || diameter < kSmall;
}

}  // namespace

CellJudgement judgeCell(const CellCorners& rest) {
  constexpr int kHalvings = 12;        // four of each side
  constexpr double kRounding = 3e-14;  // of the coefficients, relative to the product of the longest sides
  const Jacobian jacobian(rest);
  const double volume = std::accumulate(jacobian.bernstein.begin(), jacobian.bernstein.end(), 0.0) / 27;
  const double tolerance = kRounding * jacobian.scale, least = leastCorner(jacobian.bernstein);
  if (std::abs(least) <= tolerance) {
    return {isCrowded(rest) ? CellVerdict::collapsed : CellVerdict::inverted, volume};
  }
  const bool positive = isPositive(jacobian.bernstein, tolerance, kHalvings);
  return {positive ? CellVerdict::positive : CellVerdict::inverted, volume};
}

bool cellCorners(const VoxelSolid& solid, std::size_t at, CellCorners& rest,
                 std::array<std::int32_t, 8>& voxel) {
  const auto [sx, sy, sz] = solid.strides();
  for (std::size_t q = 0; q < 8; ++q) {
    const std::int64_t offset = (q & 4 ? sx : 0) + (q & 2 ? sy : 0) + (q & 1 ? sz : 0);
    voxel[q] = solid.slot[at + static_cast<std::size_t>(offset)];
    if (voxel[q] < 0) return false;
    rest[q] = toDouble(solid.rest[static_cast<std::size_t>(voxel[q])]);
  }
  return true;
}

CellSums judgeCells(const VoxelSolid& solid) {
  // In portions of fixed size, summed in their order: the same for any number of threads.
  constexpr std::size_t kPortion = 4096;
  std::vector<CellSums> portions(solid.count() / kPortion + 1);
  tbb::parallel_for(std::size_t{0}, portions.size(), [&](std::size_t portion) {
    CellSums& sums = portions[portion];
    CellCorners rest;
    std::array<std::int32_t, 8> voxel{};
    for (std::size_t v = portion * kPortion; v < std::min(solid.count(), (portion + 1) * kPortion); ++v) {
      if (!cellCorners(solid, solid.box[v], rest, voxel)) continue;
      float nearest = -1e30f;
      for (const std::int32_t corner : voxel) {
        nearest = std::max(nearest, solid.surface[static_cast<std::size_t>(corner)]);
      }
      const bool deep = nearest < -1;
      ++sums.cells;
      sums.deep += deep;
      const auto [verdict, volume] = judgeCell(rest);
      sums.volume += volume;
      sums.collapsed += verdict == CellVerdict::collapsed;
      if (verdict != CellVerdict::inverted) continue;
      ++sums.inverted;
      sums.invertedDeep += deep;
      if (nearest < sums.deepestSurface) sums.deepestSurface = nearest, sums.deepest = solid.placeOf(v);
    }
  });
  CellSums total;
  for (const CellSums& part : portions) {
    total.cells += part.cells;
    total.deep += part.deep;
    total.inverted += part.inverted;
    total.invertedDeep += part.invertedDeep;
    total.collapsed += part.collapsed;
    total.volume += part.volume;
    if (part.deepestSurface < total.deepestSurface) {
      total.deepestSurface = part.deepestSurface;
      total.deepest = part.deepest;
    }
  }
  return total;
}

}  // namespace polestar::verify
