#include "polestar/certify/voxel_cells.h"

#include <algorithm>
#include <array>

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

enum class Sign { positive, notPositive, open };

Sign signOf(const Coefficients& b) {
  for (const int corner : {0, 2, 6, 8, 18, 20, 24, 26}) {
    if (!(b[corner] > 0)) return Sign::notPositive;
  }
  return std::all_of(b.begin(), b.end(), [](double x) { return x > 0; }) ? Sign::positive : Sign::open;
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

bool positiveEverywhere(const Coefficients& b, int halvings) {
  switch (signOf(b)) {
    case Sign::positive:
      return true;
    case Sign::notPositive:
      return false;
    case Sign::open:
      break;
  }
  if (halvings == 0) return false;
  constexpr int kStrides[3] = {9, 3, 1};
  Coefficients low{}, high{};
  halve(b, kStrides[halvings % 3], low, high);
  return positiveEverywhere(low, halvings - 1) && positiveEverywhere(high, halvings - 1);
}

}  // namespace

CellQuality& CellQuality::operator+=(const CellQuality& other) {
  voxels += other.voxels;
  cells += other.cells;
  inverted += other.inverted;
  collapsed += other.collapsed;
  invertedDeep += other.invertedDeep;
  minJacobian = std::min(minJacobian, other.minJacobian);
  return *this;
}

CellQuality judgeCells(const VoxelBlock& block) {
  constexpr int kHalvings = 12;  // four of each axis
  const int n = block.size;
  const double voxelVolume = block.voxelSize * block.voxelSize * block.voxelSize;
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
        ++quality.cells;
        const Coefficients b = jacobianCoefficients(corner);
        double smallest = 1e300;
        for (const int c : {0, 2, 6, 8, 18, 20, 24, 26}) smallest = std::min(smallest, b[c]);
        quality.minJacobian = std::min(quality.minJacobian, smallest / voxelVolume);
        if (smallest == 0) {
          ++quality.collapsed;
        } else if (!positiveEverywhere(b, kHalvings)) {
          ++quality.inverted;
          quality.invertedDeep += deep;
        }
      }
    }
  }
  return quality;
}

}  // namespace polestar
