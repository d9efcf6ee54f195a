#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/laplacian.h"
#include "support.h"

namespace polestar {
namespace {

using detail::intrinsicDelaunayLaplacian;
using detail::Laplacian;
using testing::shuffledCube;
using testing::withNeedles;

std::map<std::pair<int, int>, double> entries(const Laplacian& laplacian) {
  std::map<std::pair<int, int>, double> result;
  for (std::size_t i = 0; i < laplacian.size(); ++i) {
    for (std::size_t e = laplacian.rowStart[i]; e < laplacian.rowStart[i + 1]; ++e) {
      result[{static_cast<int>(i), laplacian.column[e]}] = laplacian.weight[e];
    }
  }
  return result;
}

double largestDifference(const Laplacian& a, const Laplacian& b) {
  auto difference = entries(a);
  for (const auto& [key, weight] : entries(b)) difference[key] -= weight;
  double most = 0;
  for (const auto& [key, weight] : difference) most = std::max(most, std::abs(weight));
  return most;
}

/// 1/2 x^T L x for one value a vertex.
double energy(const Laplacian& laplacian, const std::vector<double>& x) {
  double sum = 0;
  for (const auto& [key, weight] : entries(laplacian))
    sum += 0.25 * weight * std::pow(x[key.first] - x[key.second], 2);
  return sum;
}

/// The same on the triangles as given.
double plainEnergy(const TriMesh& mesh, const std::vector<double>& x) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]];
      const Vec3 b = mesh.vertices[t[(k + 2) % 3]] - mesh.vertices[t[k]];
      sum += 0.25 * a.dot(b) / a.cross(b).norm() * std::pow(x[t[(k + 1) % 3]] - x[t[(k + 2) % 3]], 2);
    }
  }
  return sum;
}

TEST(IntrinsicDelaunay, IsSymmetricAndNeverNegative) {
  const TriMesh mesh = withNeedles(smoothStar(3), 200, 1e-4, 1);
  const auto all = entries(intrinsicDelaunayLaplacian(mesh));
  for (const auto& [key, weight] : all) {
    EXPECT_GT(weight, 0);
    EXPECT_NE(key.first, key.second);
    EXPECT_EQ(weight, all.at({key.second, key.first}));
  }
}

TEST(IntrinsicDelaunay, OnDelaunayMeshesIsTheCotangentLaplacian) {
  const TriMesh mesh = icosphere(3);
  std::vector<double> x;
  for (const Vec3& v : mesh.vertices) x.push_back(std::sin(3 * v[0]) + v[1] * v[2]);
  const double plain = plainEnergy(mesh, x);
  EXPECT_NEAR(energy(intrinsicDelaunayLaplacian(mesh), x), plain, 1e-12 * plain);
}

TEST(IntrinsicDelaunay, DoesNotSeeHowFlatPartsAreCut) {
  const Laplacian reference = intrinsicDelaunayLaplacian(shuffledCube(6, 1));
  EXPECT_LT(largestDifference(reference, intrinsicDelaunayLaplacian(shuffledCube(6, 2))), 1e-9);
  // Negative control: other diagonals do make another cotangent Laplacian where squares become rectangles'
  // halves.
  auto squeeze = [](TriMesh mesh) {
    return transformed(std::move(mesh), [](const Vec3& v) { return Vec3(v[0] + 0.4 * v[1], v[1], v[2]); });
  };
  const TriMesh a = squeeze(shuffledCube(6, 1)), b = squeeze(shuffledCube(6, 2));
  EXPECT_LT(largestDifference(intrinsicDelaunayLaplacian(a), intrinsicDelaunayLaplacian(b)), 1e-9);
  std::vector<double> x;
  for (const Vec3& v : a.vertices) x.push_back(std::sin(5 * v[0] + v[1] - 2 * v[2]));
  EXPECT_GT(std::abs(plainEnergy(a, x) - plainEnergy(b, x)), 1e-3);
}

TEST(IntrinsicDelaunay, LinearFunctionsAreHarmonicInsideFlatParts) {
  const TriMesh mesh = withNeedles(shuffledCube(8, 3), 200, 1e-3, 4);
  const Laplacian laplacian = intrinsicDelaunayLaplacian(mesh);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    int sides = 0;
    for (int axis = 0; axis < 3; ++axis) sides += std::abs(mesh.vertices[i][axis]) > 1 - 1e-12;
    if (sides != 1) continue;
    // The triangulation may cross the cube's edges, where "linear" means unfolded: keep two squares away.
    const Vec3 size = mesh.vertices[i].cwiseAbs();
    if (size.sum() - size.maxCoeff() - size.minCoeff() > 0.5) continue;
    ++inside;
    Vec3 sum = Vec3::Zero();
    double weights = 0;
    for (std::size_t e = laplacian.rowStart[i]; e < laplacian.rowStart[i + 1]; ++e) {
      sum += laplacian.weight[e] * (mesh.vertices[laplacian.column[e]] - mesh.vertices[i]);
      weights += laplacian.weight[e];
    }
    EXPECT_LT(sum.norm(), 1e-9 * weights) << mesh.vertices[i].transpose();
  }
  EXPECT_GT(inside, 100u);
}

TEST(IntrinsicDelaunay, HasTheSmallestEnergy) {
  // Among all triangulations of the same points, for every function [Rippa 1990; Bobenko, Springborn 2007].
  for (const double height : {0.3, 1e-2, 1e-5}) {
    const TriMesh mesh = withNeedles(smoothStar(3), 100, height, 7);
    std::vector<double> x;
    for (const Vec3& v : mesh.vertices) x.push_back(std::cos(4 * v[0] - 2 * v[1]) + v[2]);
    const double plain = plainEnergy(mesh, x), ours = energy(intrinsicDelaunayLaplacian(mesh), x);
    EXPECT_LT(ours, plain * (1 + 1e-9)) << height;
    EXPECT_GT(ours, 0.5 * energy(intrinsicDelaunayLaplacian(smoothStar(3)),
                                 std::vector<double>(x.begin(), x.begin() + 642)));
  }
}

TEST(IntrinsicDelaunay, BearsTrianglesOfNoArea) {
  const TriMesh mesh = withNeedles(cube(4), 60, 0, 5);
  for (const auto& [key, weight] : entries(intrinsicDelaunayLaplacian(mesh)))
    EXPECT_TRUE(std::isfinite(weight));
}

TEST(IntrinsicDelaunay, RoundedVerticesMoveItLittle) {
  const TriMesh mesh = cube(8);  // every diagonal is a tie
  const TriMesh other =
      transformed(mesh, [](const Vec3& v) { return Vec3(testing::someRotation() * v * 1e-3); });
  EXPECT_LT(largestDifference(intrinsicDelaunayLaplacian(mesh), intrinsicDelaunayLaplacian(other)), 1e-9);
}

TEST(VertexAreaShares, SumToOne) {
  const TriMesh mesh = smoothStar(2);
  const std::vector<double> shares = detail::vertexAreaShares(mesh);
  double sum = 0;
  for (const double share : shares) sum += share;
  EXPECT_NEAR(sum, 1, 1e-13);
  for (const double share : detail::vertexAreaShares(icosphere(0))) EXPECT_NEAR(share, 1.0 / 12, 1e-15);
}

}  // namespace
}  // namespace polestar
