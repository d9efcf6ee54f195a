#include "measures.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace polestar::bench {

SolidDistortion measureSolid(const VolumeMap& map, const StarShape& shape, std::size_t points) {
  const TriMesh& mesh = shape.surface().mesh();
  const Box box = boundingBox(mesh);
  const double side = std::cbrt(volumeProperties(mesh).volume / static_cast<double>(points));
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, side);
  std::vector<Vec3> x;  // one in every box of a lattice
  for (double a = box.min[0]; a < box.max[0]; a += side) {
    for (double b = box.min[1]; b < box.max[1]; b += side) {
      for (double c = box.min[2]; c < box.max[2]; c += side) {
        const double u = uniform(random), v = uniform(random), w = uniform(random);
        x.emplace_back(a + u, b + v, c + w);
      }
    }
  }
  std::vector<Mat3> jacobian(x.size());
  map.jacobian(x, jacobian);

  SolidDistortion result;
  std::vector<double> mips;
  double sum = 0, sumOfSquares = 0;
  for (const Mat3& j : jacobian) {
    if (!j.allFinite()) continue;  // outside
    ++result.points;
    const double det = j.determinant();
    if (!(det > 0)) {
      ++result.folded;
      continue;
    }
    const double root = std::cbrt(det), logarithm = std::log(det);
    mips.push_back(j.squaredNorm() / (3 * root * root));
    sum += logarithm, sumOfSquares += logarithm * logarithm;
  }
  if (mips.empty()) return result;
  const auto n = static_cast<double>(mips.size());
  for (const double m : mips) result.mipsMean += m / n;
  const auto p99 = mips.begin() + static_cast<std::ptrdiff_t>(0.99 * n);
  std::nth_element(mips.begin(), p99, mips.end());
  result.mipsP99 = *p99;
  result.logVolumeDeviation = std::sqrt(std::max(0.0, sumOfSquares / n - sum / n * (sum / n)));
  return result;
}

namespace {

double scaledJacobian(const std::array<Vec3, 8>& corner) {
  // Neighbours of every corner along the three axes, right-handed; 0 to 3 inside, 4 to 7 above them.
  constexpr int kAxes[8][3] = {{1, 3, 4}, {2, 0, 5}, {3, 1, 6}, {0, 2, 7},
                               {7, 5, 0}, {4, 6, 1}, {5, 7, 2}, {6, 4, 3}};
  double least = 1;
  for (int k = 0; k < 8; ++k) {
    std::array<Vec3, 3> edge;
    for (int axis = 0; axis < 3; ++axis) edge[axis] = (corner[kAxes[k][axis]] - corner[k]).normalized();
    const double value = edge[0].cross(edge[1]).dot(edge[2]);
    least = value < least || std::isnan(value) ? value : least;
  }
  return least;
}

}  // namespace

HexDistortion measureHexahedra(const VolumeMap& map, int cells) {
  constexpr double kInnermost = 0.1;
  const int nodes = cells + 1;
  std::vector<double> values;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    const double sign = face % 2 == 0 ? 1 : -1;
    std::vector<Vec3> ball, solid;
    for (int layer = 0; layer < nodes; ++layer) {
      const double radius = kInnermost + (1 - kInnermost) * layer / cells;
      for (int i = 0; i < nodes; ++i) {
        for (int j = 0; j < nodes; ++j) {
          Vec3 d;
          d[axis] = sign;
          d[(axis + 1) % 3] = sign * std::tan(std::numbers::pi / 4 * (2.0 * i / cells - 1));
          d[(axis + 2) % 3] = std::tan(std::numbers::pi / 4 * (2.0 * j / cells - 1));
          ball.push_back(radius * d.normalized());
        }
      }
    }
    solid.resize(ball.size());
    map.inverse(ball, solid);
    const auto at = [&](int layer, int i, int j) { return solid[(layer * nodes + i) * nodes + j]; };
    for (int layer = 0; layer < cells; ++layer) {
      for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
          std::array<Vec3, 8> corner;
          for (int k = 0; k < 8; ++k) {
            const int a = (k % 4 == 1 || k % 4 == 2) ? 1 : 0, b = k % 4 >= 2 ? 1 : 0;
            corner[k] = at(layer + k / 4, i + a, j + b);
          }
          values.push_back(scaledJacobian(corner));
        }
      }
    }
  }
  HexDistortion result;
  result.cells = values.size();
  for (double& value : values) {
    if (std::isnan(value)) value = -1;
    result.bad += !(value > 0);
    result.mean += value / static_cast<double>(values.size());
  }
  std::sort(values.begin(), values.end());
  result.min = values.front();
  result.p1 = values[values.size() / 100];
  return result;
}

}  // namespace polestar::bench
