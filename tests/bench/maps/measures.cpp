#include "measures.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "polestar/mesh/tet_orientation.h"

namespace polestar::bench {

std::vector<Vec3> latticePoints(const StarShape& shape, std::size_t count) {
  const TriMesh& mesh = shape.surface().mesh();
  const Box box = boundingBox(mesh);
  const double side = std::cbrt(volumeProperties(mesh).volume / static_cast<double>(count));
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, side);
  std::vector<Vec3> points;
  for (double a = box.min[0]; a < box.max[0]; a += side) {
    for (double b = box.min[1]; b < box.max[1]; b += side) {
      for (double c = box.min[2]; c < box.max[2]; c += side) {
        const double u = uniform(random), v = uniform(random), w = uniform(random);
        points.emplace_back(a + u, b + v, c + w);
      }
    }
  }
  return points;
}

namespace {

/// Determinants below this share of the matrix' norm to the third are 0 to rounding.
constexpr double kRounding = 1e-12;

bool positive(const Mat3& matrix, double determinant) {
  return determinant > kRounding * std::pow(matrix.norm(), 3);
}

double mips(const Mat3& jacobian, double determinant) {
  const double root = std::cbrt(determinant);
  return jacobian.squaredNorm() / (3 * root * root);
}

struct Weighted {
  double value, weight;
};

Spread spreadOf(std::vector<Weighted> values) {
  std::sort(values.begin(), values.end(), [](auto& a, auto& b) { return a.value < b.value; });
  double total = 0, sum = 0, below = 0;
  for (const auto& [value, weight] : values) total += weight, sum += weight * value;
  if (!(total > 0)) return {};
  for (const auto& [value, weight] : values) {
    below += weight;
    if (below >= 0.99 * total) return {sum / total, value};
  }
  return {sum / total, values.back().value};
}

double deviationOf(const std::vector<Weighted>& values) {
  double total = 0, mean = 0, squares = 0;
  for (const auto& [value, weight] : values) total += weight, mean += weight * value;
  if (!(total > 0)) return 0;
  mean /= total;
  for (const auto& [value, weight] : values) squares += weight * (value - mean) * (value - mean);
  return std::sqrt(squares / total);
}

// With J the derivative and u the unit vector to the image, radii leave along J^-1 u and spheres have the
// normal J^T u; the product of the two is 1.
double skewInDegrees(const Mat3& jacobian, const Vec3& image) {
  const Vec3 u = image.normalized();
  const double lengths = (jacobian.inverse() * u).norm() * (jacobian.transpose() * u).norm();
  return 180 / std::numbers::pi * std::acos(std::min(1.0, 1 / lengths));
}

}  // namespace

SolidDistortion measureSolid(const VolumeMap& map, std::span<const Vec3> points, double core) {
  std::vector<Mat3> jacobian(points.size());
  std::vector<Vec3> image(points.size());
  map.jacobian(points, jacobian);
  map.forward(points, image);
  SolidDistortion result;
  std::vector<Weighted> shapes, volumes, skews;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!jacobian[i].allFinite()) continue;  // outside
    ++result.points;
    const double determinant = jacobian[i].determinant();
    if (!positive(jacobian[i], determinant)) {
      ++result.folded;
      continue;
    }
    shapes.push_back({mips(jacobian[i], determinant), 1});
    volumes.push_back({std::log(determinant), 1});
    if (image[i].norm() > core) skews.push_back({skewInDegrees(jacobian[i], image[i]), 1});
  }
  result.mips = spreadOf(std::move(shapes));
  result.logVolumeDeviation = deviationOf(volumes);
  result.skew = spreadOf(std::move(skews));
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

TetDistortion measureTetrahedra(const TetMesh& mesh, std::span<const Vec3> image) {
  std::vector<Vec3> rounded;
  for (const Vec3& p : image) rounded.push_back(p.cast<float>().cast<double>());
  const TetReport signs = compareTetrahedra(mesh.tetrahedra, mesh.vertices, rounded);
  TetDistortion result;
  result.tetrahedra = signs.tetrahedra;
  result.onSurface = signs.onBoundary;
  result.invertedOnSurface = signs.turnedOnBoundary + signs.flattenedOnBoundary;
  result.inverted = signs.bad.size() - result.invertedOnSurface;

  std::vector<Weighted> bySolid, byBall, volumes;
  for (const auto& t : mesh.tetrahedra) {
    Mat3 before, after;
    for (int k = 0; k < 3; ++k) {
      before.col(k) = mesh.vertices[t[k + 1]] - mesh.vertices[t[0]];
      after.col(k) = image[t[k + 1]] - image[t[0]];
    }
    const double volume = before.determinant(), ratio = after.determinant() / volume;
    if (!positive(before, std::abs(volume)) || !positive(after, ratio * std::abs(volume))) continue;
    const double shape = mips(after * before.inverse(), ratio);
    bySolid.push_back({shape, std::abs(volume)});
    byBall.push_back({shape, std::abs(volume) * ratio});
    volumes.push_back({std::log(ratio), std::abs(volume)});
  }
  result.mipsBySolid = spreadOf(std::move(bySolid));
  result.mipsByBall = spreadOf(std::move(byBall));
  result.logVolumeDeviation = deviationOf(volumes);
  return result;
}

}  // namespace polestar::bench
