// The opponents of the benchmark, held to exact answers: they solve what they are said to solve, at their
// order.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "exact_solid.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "tet_laplacian.h"
#include "tetgen.h"
#include "voxel_poisson.h"

namespace polestar::bench {
namespace {

double linear(const Vec3& x) { return 0.7 + x[0] - 2 * x[1] + 0.5 * x[2]; }

std::function<double(const Vec3&)> boundaryValue(const ExactSolid& solid) {
  return [pole = solid.pole](const Vec3& x) { return -1 / (x - pole).norm(); };
}

/// max rho |h - h_exact| at the benchmark's points.
double errorOf(const ExactSolid& solid, const std::vector<Vec3>& points, const std::vector<double>& h) {
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double exact = solid.green(points[i]) - 1 / (points[i] - solid.pole).norm();
    worst = std::max(worst, std::abs(solid.harmonicRadius * (h[i] - exact)));
  }
  return worst;
}

double voxelError(const ExactSolid& solid, int dim, VoxelBoundary boundary) {
  VoxelPoisson poisson({solid.box, solid.inside, boundaryValue(solid)}, {.dim = dim, .boundary = boundary});
  poisson.solve();
  const std::vector<Vec3> points = probes(solid, 400);
  std::vector<double> h(points.size());
  poisson.evaluate(points, h);
  return errorOf(solid, points, h);
}

/// The polyhedron of `surface`, star-shaped about the origin, in shells of prisms cut in three.
TetMesh shells(const TriMesh& surface, int count) {
  TetMesh mesh;
  mesh.surfaceVertices = surface.vertices.size();
  const auto n = static_cast<std::int32_t>(surface.vertices.size());
  for (int shell = 0; shell < count; ++shell) {
    for (const Vec3& v : surface.vertices)
      mesh.vertices.push_back((1 - static_cast<double>(shell) / count) * v);
  }
  mesh.vertices.emplace_back(Vec3::Zero());
  for (Triangle t : surface.triangles) {
    // Smallest index first: neighbours then cut the quadrilateral between them along the same diagonal.
    std::sort(t.begin(), t.end());
    const auto [a, b, c] = t;
    for (int shell = 0; shell + 1 < count; ++shell) {
      const std::int32_t o = shell * n, i = o + n;
      mesh.tetrahedra.push_back({o + a, o + b, o + c, i + c});
      mesh.tetrahedra.push_back({o + a, o + b, i + b, i + c});
      mesh.tetrahedra.push_back({o + a, i + a, i + b, i + c});
    }
    const std::int32_t o = (count - 1) * n;
    mesh.tetrahedra.push_back({o + a, o + b, o + c, count * n});
  }
  return mesh;
}

double volume(const TetMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.tetrahedra) {
    const Vec3& o = mesh.vertices[t[0]];
    sum +=
        std::abs((mesh.vertices[t[1]] - o).cross(mesh.vertices[t[2]] - o).dot(mesh.vertices[t[3]] - o)) / 6;
  }
  return sum;
}

double tetError(const ExactSolid& solid, const TetMesh& mesh) {
  const TetSolution solution = solveTetLaplacian(mesh, boundaryValue(solid));
  const std::vector<Vec3> points = probes(solid, 400);
  std::vector<double> h(points.size());
  interpolateOnTets(mesh, solution.h, points, h);
  return errorOf(solid, points, h);
}

TEST(ExactSolids, ProbesLieInsideAndTheGreensFunctionVanishesWhereRaysLeave) {
  for (const ExactSolid& solid : exactSolids()) {
    const std::vector<Vec3> points = probes(solid, 40);
    ASSERT_EQ(points.size(), 40U);
    for (const Vec3& x : points) {
      EXPECT_TRUE(solid.inside(x)) << solid.name;
      const Vec3 way = (x - solid.pole).normalized();
      const Vec3 exit = crossing(solid.inside, solid.pole, solid.pole + 2 * solid.box.diagonal() * way);
      EXPECT_LE((x - solid.pole).norm(), 0.99601 * (exit - solid.pole).norm()) << solid.name;
      EXPECT_NEAR(solid.green(exit), 0, 2e-6) << solid.name;
    }
  }
}

TEST(ExactSolids, SurfacesHaveAboutTheVerticesAskedForAndLieOnTheSolid) {
  for (const ExactSolid& solid : exactSolids()) {
    for (const int size : {640, 2500}) {
      const TriMesh mesh = solid.surface(size);
      EXPECT_NEAR(static_cast<double>(mesh.vertices.size()), size, 0.1 * size) << solid.name;
      for (const Vec3& v : mesh.vertices) {
        const Vec3 way = v - solid.pole;
        EXPECT_TRUE(solid.inside(solid.pole + (1 - 1e-9) * way)) << solid.name;
        EXPECT_FALSE(solid.inside(solid.pole + (1 + 1e-9) * way)) << solid.name;
      }
    }
  }
}

TEST(VoxelPoisson, LinearFunctionsAreExact) {
  const ExactSolid& ball = exactSolid("ball");
  for (const VoxelBoundary boundary : {VoxelBoundary::neighbours, VoxelBoundary::crossings}) {
    VoxelPoisson poisson({ball.box, ball.inside, linear},
                         {.dim = 20, .boundary = boundary, .residual = 1e-11});
    poisson.solve();
    const std::vector<Vec3> points = probes(ball, 200);
    std::vector<double> h(points.size());
    poisson.evaluate(points, h);
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(h[i], linear(points[i]), 1e-8);
  }
}

TEST(VoxelPoisson, CountsItsVoxels) {
  const ExactSolid& cube = exactSolid("cube");
  const VoxelPoisson poisson({cube.box, cube.inside, linear}, {.dim = 10});
  EXPECT_EQ(poisson.voxels(), 1000U);
  EXPECT_EQ(poisson.boundaryVoxels(), 1000U - 512U);
}

TEST(VoxelPoisson, CutCellsAreOfSecondOrderAndPlainVoxelsOfFirst) {
  const ExactSolid& ball = exactSolid("ball");
  const double cut = voxelError(ball, 24, VoxelBoundary::crossings);
  EXPECT_GT(cut / voxelError(ball, 48, VoxelBoundary::crossings), 3);
  const double plain = voxelError(ball, 24, VoxelBoundary::neighbours);
  const double ratio = plain / voxelError(ball, 48, VoxelBoundary::neighbours);
  EXPECT_GT(ratio, 1.5);
  EXPECT_LT(ratio, 3);
  EXPECT_GT(plain, 100 * cut);
}

TEST(VoxelPoisson, SolvesTheCubeAndTheHalfBall) {
  // The cube's surface lies half a voxel from the centers everywhere, the half ball's rim at any angle.
  for (const char* name : {"cube", "half ball"}) {
    const double coarse = voxelError(exactSolid(name), 16, VoxelBoundary::crossings);
    EXPECT_GT(coarse / voxelError(exactSolid(name), 32, VoxelBoundary::crossings), 2.5) << name;
  }
}

TEST(TetLaplacian, LinearFunctionsAreExact) {
  TetMesh mesh = shells(geodesicSphere(4), 4);
  // The orientation of tetrahedra does not matter.
  std::swap(mesh.tetrahedra[5][0], mesh.tetrahedra[5][1]);
  const TetSolution solution = solveTetLaplacian(mesh, linear, 1e-13);
  std::vector<Vec3> points = probes(exactSolid("ball"), 200);
  for (Vec3& x : points) x *= 0.9;
  std::vector<double> h(points.size());
  interpolateOnTets(mesh, solution.h, points, h);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(h[i], linear(points[i]), 1e-10);
}

TEST(TetLaplacian, MinimizesTheDirichletEnergyOfOneTetrahedron) {
  // A regular tetrahedron with one vertex inside: by symmetry it is the mean of the corners.
  TetMesh mesh;
  mesh.vertices = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}, {0, 0, 0}};
  mesh.surfaceVertices = 4;
  mesh.tetrahedra = {{0, 1, 2, 4}, {0, 1, 3, 4}, {0, 2, 3, 4}, {1, 2, 3, 4}};
  const TetSolution solution =
      solveTetLaplacian(mesh, [](const Vec3& x) { return x[0] * x[1] + 3 * x[2] * x[2] + x[0]; });
  EXPECT_NEAR(solution.h[4], 3, 1e-12);
}

TEST(TetLaplacian, ConvergesToTheKelvinImageAtSecondOrder) {
  const ExactSolid& ball = exactSolid("ball");
  const double coarse = tetError(ball, shells(geodesicSphere(8), 8));
  const double fine = tetError(ball, shells(geodesicSphere(16), 16));
  EXPECT_LT(fine, 1e-2);
  EXPECT_GT(coarse / fine, 3);
}

TEST(TetGen, FillsTheSolidAndKeepsItsSurface) {
  const TriMesh surface = exactSolid("cube").surface(150);
  const std::optional<TetMesh> mesh = tetrahedralize(surface);
  if (!mesh) GTEST_SKIP() << "no tetgen on the PATH (apt-get install tetgen)";
  EXPECT_NEAR(volume(*mesh), 8, 1e-9);
  ASSERT_EQ(mesh->surfaceVertices, surface.vertices.size());
  for (std::size_t v = 0; v < surface.vertices.size(); ++v)
    EXPECT_NEAR((mesh->vertices[v] - surface.vertices[v]).norm(), 0, 1e-12);
  for (std::size_t v = mesh->surfaceVertices; v < mesh->vertices.size(); ++v)
    EXPECT_LT(mesh->vertices[v].cwiseAbs().maxCoeff(), 1 - 1e-6);
}

TEST(TetGen, ItsTetrahedraCarryTheGreensFunction) {
  const ExactSolid& ball = exactSolid("ball");
  const std::optional<TetMesh> coarse = tetrahedralize(ball.surface(640));
  if (!coarse) GTEST_SKIP() << "no tetgen on the PATH (apt-get install tetgen)";
  EXPECT_GT(tetError(ball, *coarse) / tetError(ball, tetrahedralize(ball.surface(2560)).value()), 2.5);
}

}  // namespace
}  // namespace polestar::bench
