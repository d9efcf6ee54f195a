#include "polestar/sphere/column_descent.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/sphere_map.h"
#include "support.h"

namespace polestar {
namespace {

/// Dirichlet energy of the surface's triangles, weighted by their area, and a constant for the way inward.
std::vector<ColumnEnergy> columnsOf(const TriMesh& mesh, double logWeight) {
  std::vector<ColumnEnergy> columns(mesh.triangles.size());
  for (std::size_t t = 0; t < columns.size(); ++t) {
    const double area = 0.5 * areaVector(mesh, t).norm();
    columns[t].constant = area;
    for (int k = 0; k < 3; ++k) {
      const Vec3 p = mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k),
                 q = mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k);
      columns[t].edge[k] = 0.25 * p.dot(q) / area;
    }
    columns[t].logWeight = logWeight * area;
    columns[t].logOffset = -std::log(2 * area);
  }
  return columns;
}

double energyOf(const TriMesh& mesh, const std::vector<ColumnEnergy>& columns, const std::vector<Vec3>& p) {
  double sum = 0;
  for (std::size_t t = 0; t < columns.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const double det = p[a].dot(p[b].cross(p[c]));
    double bracket = columns[t].constant;
    for (int k = 0; k < 3; ++k)
      bracket += columns[t].edge[k] *
                 (p[mesh.triangles[t][(k + 1) % 3]] - p[mesh.triangles[t][(k + 2) % 3]]).squaredNorm();
    sum += bracket / std::pow(det, 2.0 / 3) +
           columns[t].logWeight * std::pow(std::log(det) + columns[t].logOffset, 2);
  }
  return sum;
}

TEST(ColumnDescent, EndsWhereNothingNearIsLower) {
  const TriMesh mesh = smoothStar(3);
  for (const double logWeight : {0.0, 0.3}) {
    const std::vector<ColumnEnergy> columns = columnsOf(mesh, logWeight);
    std::vector<Vec3> p = icosphere(3).vertices;
    const ColumnDescentResult result =
        descendColumns(mesh.triangles, columns, p, 300, 1e-8, Context::quiet());
    EXPECT_LT(result.remaining, 1e-6);
    EXPECT_LT(result.after, result.before);
    EXPECT_NEAR(result.before, energyOf(mesh, columns, icosphere(3).vertices), 1e-9 * result.before);
    EXPECT_NEAR(result.after, energyOf(mesh, columns, p), 1e-9 * result.after);
    EXPECT_EQ(countFlips(p, mesh.triangles), 0u);
    std::mt19937 random(2);
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 50; ++trial) {
      std::vector<Vec3> near = p;
      Vec3& moved = near[random() % near.size()];
      moved = (moved + 1e-4 * Vec3(normal(random), normal(random), normal(random))).normalized();
      EXPECT_GT(energyOf(mesh, columns, near), result.after * (1 - 1e-12));
    }
  }
}

TEST(ColumnDescent, NeverFlips) {
  // Pulled to one side, triangles want to pass through one another.
  TriMesh mesh = testing::withNeedles(smoothStar(3), 60, 1e-3, 4);
  std::vector<Vec3> p;
  for (const Vec3& v : mesh.vertices) p.push_back((v + Vec3(0.5, 0.2, 0)).normalized());
  ASSERT_EQ(countFlips(p, mesh.triangles), 0u);
  const ColumnDescentResult result =
      descendColumns(mesh.triangles, columnsOf(mesh, 0.1), p, 60, 1e-8, Context::quiet());
  EXPECT_LT(result.after, result.before);
  EXPECT_EQ(countFlips(p, mesh.triangles), 0u);
}

TEST(ColumnDescent, RefusesAStartWithFlips) {
  const TriMesh mesh = icosphere(2);
  std::vector<Vec3> mirrored = mesh.vertices;
  for (Vec3& v : mirrored) v[2] = -v[2];
  EXPECT_THROW(descendColumns(mesh.triangles, columnsOf(mesh, 0), mirrored, 5, 1e-8, Context::quiet()),
               Error);
}

TEST(ColumnDescent, SameBytesForAnyNumberOfThreads) {
  const TriMesh mesh = smoothStar(4);
  std::vector<std::vector<Vec3>> results;
  for (const int threads : {1, 3}) {
    withThreads(threads, [&] {
      results.push_back(icosphere(4).vertices);
      descendColumns(mesh.triangles, columnsOf(mesh, 0.1), results.back(), 10, 1e-8, Context::quiet());
    });
  }
  EXPECT_TRUE(results[0] == results[1]);
}

}  // namespace
}  // namespace polestar
