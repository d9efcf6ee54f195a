#include "polestar/certify/voxel_cells.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "polestar/core/predicates.h"

namespace polestar {
namespace {

using Corners = std::array<Vec3, 8>;          // index 4 i + 2 j + k for corner (i, j, k)
using Coefficients = std::array<double, 27>;  // Bernstein, index 9 i + 3 j + k

// Bernstein coefficients of det(d/du, d/dv, d/dw) of the trilinear map. d/du is bilinear in (v, w), and so
// on; products of linear Bernstein polynomials in one variable are B0 B0 = B0, B0 B1 = B1 / 2, B1 B1 = B2 of
// degree two.
Coefficients jacobianCoefficients(const Corners& c) {
  Coefficients result{};
  auto at = [&](int i, int j, int k) -> const Vec3& { return c[4 * i + 2 * j + k]; };
  for (int uj = 0; uj < 2; ++uj) {
    for (int uk = 0; uk < 2; ++uk) {
      const Vec3 du = at(1, uj, uk) - at(0, uj, uk);
      for (int vi = 0; vi < 2; ++vi) {
        for (int vk = 0; vk < 2; ++vk) {
          const Vec3 normal = du.cross(at(vi, 1, vk) - at(vi, 0, vk));
          const double kShare = uk == vk ? 1 : 0.5;
          for (int wi = 0; wi < 2; ++wi) {
            const double iShare = vi == wi ? 1 : 0.5;
            for (int wj = 0; wj < 2; ++wj) {
              const double jShare = uj == wj ? 1 : 0.5;
              const Vec3 dw = at(wi, wj, 1) - at(wi, wj, 0);
              result[9 * (vi + wi) + 3 * (uj + wj) + (uk + vk)] += iShare * jShare * kShare * normal.dot(dw);
            }
          }
        }
      }
    }
  }
  return result;
}

constexpr int kHalvings = 12;  // four of each axis

// A bound for the error of every coefficient, through all halvings.
//
// Samples are floats, exact in doubles, and their products are above 2^-450: nothing underflows. With a, b, c
// the largest components of the cell's edges along u, v, w and e = 2^-53: an edge carries one rounding, a
// minor of two edges two more on at most 2 a b, its product with the third and the sum over three minors
// three more. So a determinant, at most 6 a b c, is off by 8 e of that. A coefficient is a mean of up to
// eight (weights are powers of two): seven additions. Every halving takes two means. Together
// 6 (8 + 7 + 2 * 12) e a b c = 234 e a b c; 2^8 covers products of roundings, too.
double roundingBound(const Corners& c) {
  constexpr double kBound = 0x1p-45;
  double product = kBound;
  for (const int axis : {4, 2, 1}) {
    double largest = 0;
    for (int q = 0; q < 8; ++q) {
      if (!(q & axis)) largest = std::max(largest, (c[q | axis] - c[q]).cwiseAbs().maxCoeff());
    }
    product *= largest;
  }
  return product;
}

constexpr std::array<int, 8> kCornerCoefficients{0, 2, 6, 8, 18, 20, 24, 26};

// Exact sign of the Jacobian at corner q: the tetrahedron of the corner and its three neighbours.
int signAtCorner(const Corners& c, int q) {
  const int sign = orient3d(c[q], c[q ^ 4], c[q ^ 2], c[q ^ 1]);
  return std::popcount(static_cast<unsigned>(q)) % 2 == 0 ? sign : -sign;
}

int leastSignAtCorners(const Corners& corners, const Coefficients& b, double bound) {
  int least = 1;
  for (int q = 0; q < 8; ++q) {
    const double value = b[kCornerCoefficients[q]];
    const bool decided = std::abs(value) > bound;
    least = std::min(least, decided ? (value > 0 ? 1 : -1) : signAtCorner(corners, q));
  }
  return least;
}

// De Casteljau at 1/2 along one axis (stride 9, 3 or 1).
void halve(const Coefficients& b, int stride, Coefficients& low, Coefficients& high) {
  for (int i = 0; i < 27; ++i) {
    if (i / stride % 3 != 0) continue;
    const double b0 = b[i], b1 = b[i + stride], b2 = b[i + 2 * stride];
    const double m0 = 0.5 * (b0 + b1), m1 = 0.5 * (b1 + b2), m = 0.5 * (m0 + m1);
    low[i] = b0;
    low[i + stride] = m0;
    low[i + 2 * stride] = high[i] = m;
    high[i + stride] = m1;
    high[i + 2 * stride] = b2;
  }
}

enum class Positivity { shown, refuted, open };

// Of the determinant, its coefficients known to `bound`.
Positivity judge(const Coefficients& b, double bound, int halvings) {
  if (std::all_of(b.begin(), b.end(), [&](double x) { return x > bound; })) return Positivity::shown;
  bool worthHalving = halvings > 0;
  for (const int corner : kCornerCoefficients) {
    if (b[corner] < -bound) return Positivity::refuted;
    // A value of the determinant itself, which no halving moves.
    worthHalving = worthHalving && b[corner] > bound;
  }
  if (!worthHalving) return Positivity::open;
  constexpr int kStrides[3] = {9, 3, 1};
  Coefficients low{}, high{};
  halve(b, kStrides[halvings % 3], low, high);
  const Positivity first = judge(low, bound, halvings - 1);
  return first == Positivity::shown ? judge(high, bound, halvings - 1) : first;
}

bool areFinite(const Corners& corners) {
  return std::all_of(corners.begin(), corners.end(), [](const Vec3& y) { return y.allFinite(); });
}

// Leaves the volume of the voxel out of minJacobian.
void addCell(const Corners& corners, bool deep, CellQuality& quality) {
  ++quality.cells;
  const Coefficients b = jacobianCoefficients(corners);
  for (const int c : kCornerCoefficients) quality.minJacobian = std::min(quality.minJacobian, b[c]);
  const double bound = roundingBound(corners);
  const Positivity found = judge(b, bound, kHalvings);
  if (found == Positivity::shown) return;
  const int least = areFinite(corners) ? leastSignAtCorners(corners, b, bound) : -1;
  if (least == 0) {
    ++quality.collapsed;
    quality.collapsedDeep += deep;
    return;
  }
  ++quality.inverted;
  quality.invertedDeep += deep;
  quality.undecided += least > 0 && found == Positivity::open;
}

}  // namespace

CellQuality& CellQuality::operator+=(const CellQuality& other) {
  voxels += other.voxels;
  cells += other.cells;
  inverted += other.inverted;
  undecided += other.undecided;
  collapsed += other.collapsed;
  invertedDeep += other.invertedDeep;
  collapsedDeep += other.collapsedDeep;
  minJacobian = std::min(minJacobian, other.minJacobian);
  return *this;
}

CellQuality judgeCells(const VoxelBlock& block) {
  const int n = block.size;
  CellQuality quality;
  for (int i = 0; i + 1 < n; ++i) {
    for (int j = 0; j + 1 < n; ++j) {
      for (int k = 0; k + 1 < n; ++k) {
        Corners corner;
        bool inside = true, deep = true;
        for (int q = 0; q < 8; ++q) {
          const int at = ((i + (q >> 2)) * n + j + (q >> 1 & 1)) * n + k + (q & 1);
          const bool in = block.active[at] && block.signedDistance[at] < 0;
          if (q == 0) quality.voxels += in;
          inside = inside && in;
          deep = deep && block.signedDistance[at] < -block.voxelSize;
          corner[q] = block.rest[at].cast<double>();
        }
        if (!inside) continue;
        addCell(corner, deep, quality);
      }
    }
  }
  if (quality.cells > 0) quality.minJacobian /= block.voxelSize * block.voxelSize * block.voxelSize;
  return quality;
}

std::vector<std::array<int, 3>> deepInvertedCells(const VoxelBlock& block) {
  const auto n = static_cast<std::size_t>(block.size);
  std::vector<std::array<int, 3>> found;
  std::array<Vec3f, 8> rest;
  std::array<float, 8> distance;
  std::array<std::uint8_t, 8> active;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    for (std::size_t j = 0; j + 1 < n; ++j) {
      for (std::size_t k = 0; k + 1 < n; ++k) {
        for (std::size_t c = 0; c < 8; ++c) {
          const std::size_t id = ((i + (c >> 2)) * n + j + (c >> 1 & 1)) * n + k + (c & 1);
          rest[c] = block.rest[id];
          distance[c] = block.signedDistance[id];
          active[c] = block.active[id];
        }
        if (judgeCells({2, rest, distance, active, block.voxelSize}).invertedDeep > 0)
          found.push_back({static_cast<int>(i), static_cast<int>(j), static_cast<int>(k)});
      }
    }
  }
  return found;
}

MendedBlock mendedBlock(const VoxelBlock& before, std::vector<Vec3f> rest) {
  MendedBlock result;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (rest[i] == before.rest[i]) continue;
    result.moved.push_back(i);
    result.largestMove =
        std::max(result.largestMove, (rest[i].cast<double>() - before.rest[i].cast<double>()).norm());
  }
  result.rest = std::move(rest);
  return result;
}

}  // namespace polestar
