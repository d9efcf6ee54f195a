#include "polestar/green/detail/enclosure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "green/densities.h"
#include "polestar/core/error.h"
#include "polestar/green/detail/flat_variation.h"
#include "polestar/green/detail/layer_majorants.h"
#include "polestar/mesh/principal_axes.h"
#include "polestar/mesh/shapes.h"
#include "support/exact_green.h"
#include "support/layer_potential.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar::detail {
namespace {

using testing::BallGreen;
using testing::layerPotential;
using testing::needles;
using testing::pointsInside;
using testing::roughDensity;
using testing::smoothDensity;
using testing::starShape;

const Vec3 kPole(0.3, 0.2, -0.1);

// Points of a triangle, many of them next to its edges and corners, where the layer's potential is least
// smooth.
std::vector<Vec3> pointsOf(const Piece& piece, std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<double, 3> weight{};
    for (double& w : weight) w = -std::log(1 - uniform(random));
    if (i % 3 == 1) weight[random() % 3] *= std::pow(10, -8 * uniform(random));
    if (i % 3 == 2) {
      for (int k = 0; k < 2; ++k) weight[(i + k) % 3] *= std::pow(10, -8 * uniform(random));
    }
    const double sum = weight[0] + weight[1] + weight[2];
    points.push_back((weight[0] * piece[0] + weight[1] * piece[1] + weight[2] * piece[2]) / sum);
  }
  return points;
}

Piece triangleOf(const TriMesh& mesh, std::size_t t) {
  return {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
}

double greenAt(const TriMesh& mesh, std::span<const double> density, const Vec3& x) {
  return 1 / x.norm() + layerPotential(mesh, density, x);
}

TEST(LayerMajorants, BoundTheQuadratureErrorWhereverItIsLookedAt) {
  for (const TriMesh& mesh : {icosphere(2), icosphere(3), cube(6), needles()}) {
    for (const std::vector<double>& density : {roughDensity(mesh), smoothDensity(mesh)}) {
      const LayerQuadrature quadrature(mesh, Context::quiet());
      const LayerJumps jumps(mesh, density);
      const LayerMajorants majorants(mesh, quadrature, density, jumps);
      const double everywhere = majorants.largestQuadratureError(enclosingCube(mesh.vertices), 1.5, 20000);
      PointCharges charges = quadrature.places();
      charges.charge = quadrature.chargesFor(density);
      std::mt19937 random(2);
      double largest = 0, largestBound = 0;
      for (int i = 0; i < 300; ++i) {
        const std::size_t t = random() % mesh.triangles.size();
        const double shrink = i % 2 ? 1 : std::pow(10, -3 * std::uniform_real_distribution<double>()(random));
        const Vec3 x = (i % 2 ? 1 : 1 - shrink) * pointsOf(triangleOf(mesh, t), 1, random)[0];
        double value = 0;
        sumPotential(charges, {&x, 1}, {&value, 1});
        quadrature.addNearPotential({&x, 1}, quadrature.near().density(density), {&value, 1},
                                    Context::quiet());
        const double error = std::abs(value - layerPotential(mesh, density, x));
        const double bound = majorants.quadratureError({x, 0});
        EXPECT_LE(error, bound + 1e-12);
        EXPECT_LE(bound, majorants.quadratureError({x + Vec3(0.01, 0, 0), 0.02}) * (1 + 1e-9));
        EXPECT_LE(bound, everywhere);
        largest = std::max(largest, error);
        largestBound = std::max(largestBound, bound);
      }
      EXPECT_GT(largest, 0.005 * largestBound) << "a bound that far off is not worth much";
    }
  }
}

TEST(FlatVariation, IsNeverBelowWhatAPieceShows) {
  for (const TriMesh& mesh : {icosphere(1), icosphere(2), cube(3), needles(), halfBall(3)}) {
    for (const std::vector<double>& density : {roughDensity(mesh), smoothDensity(mesh)}) {
      TriMesh moved = mesh;  // the pole must not lie on the surface
      for (Vec3& v : moved.vertices)
        v -= Vec3(0.02, 0.01, mesh.vertices.size() == halfBall(3).vertices.size() ? 0.4 : 0);
      const LayerQuadrature quadrature(moved, Context::quiet());
      const LayerJumps jumps(moved, density);
      const LayerMajorants majorants(moved, quadrature, density, jumps);
      const FlatVariation flat(moved, density, jumps, majorants);
      std::mt19937 random(11);
      for (int trial = 0; trial < 12; ++trial) {
        const std::size_t t = random() % moved.triangles.size();
        Patch patch = flat.patch(t);
        Piece piece = triangleOf(moved, t);
        for (int level = 0; level < 6; ++level) {
          const double bound = patch.variation(piece);
          std::array<double, 3> corner;
          for (int k = 0; k < 3; ++k) corner[k] = greenAt(moved, density, piece[k]);
          for (const Vec3& x : pointsOf(piece, 12, random)) {
            // Weights of the point in the piece.
            Eigen::Matrix<double, 3, 2> sides;
            sides << piece[1] - piece[0], piece[2] - piece[0];
            const Eigen::Vector2d w = sides.colPivHouseholderQr().solve(x - piece[0]);
            const double linear = (1 - w[0] - w[1]) * corner[0] + w[0] * corner[1] + w[1] * corner[2];
            EXPECT_LE(std::abs(greenAt(moved, density, x) - linear), bound + 1e-11) << t << ' ' << level;
          }
          // Into one of its quarters, as the enclosure goes.
          patch = patch.narrowed(piece);
          const int k = static_cast<int>(random() % 4);
          const Piece middle{0.5 * (piece[0] + piece[1]), 0.5 * (piece[1] + piece[2]),
                             0.5 * (piece[2] + piece[0])};
          piece = k < 3 ? Piece{piece[k], middle[k], middle[(k + 2) % 3]} : middle;
        }
      }
    }
  }
}

TEST(FlatVariation, FallsLikeTheAreaOfPieces) {
  const TriMesh mesh = icosphere(3);
  const std::vector<double> density = smoothDensity(mesh);
  const LayerQuadrature quadrature(mesh, Context::quiet());
  const LayerJumps jumps(mesh, density);
  const LayerMajorants majorants(mesh, quadrature, density, jumps);
  const Patch patch = FlatVariation(mesh, density, jumps, majorants).patch(100);
  Piece piece = triangleOf(mesh, 100);
  const double whole = patch.variation(piece);
  for (int level = 0; level < 4; ++level)
    piece = {0.5 * (piece[0] + piece[1]), 0.5 * (piece[1] + piece[2]), 0.5 * (piece[2] + piece[0])};
  EXPECT_LT(patch.variation(piece), 0.01 * whole);
}

Enclosure enclose(const TriMesh& mesh, std::span<const double> density, double radius, std::size_t points) {
  const auto surface = std::make_shared<const AlignedSurface>(mesh, principalAxes(mesh), Context::quiet());
  const LayerField field(surface, density, 1e-6, Context::quiet(), 2e-5);
  Context context;
  return encloseBoundary(field, radius, {.goal = 1e-5, .points = points}, context);
}

GreenFunction onePass(const StarShape& shape) {
  GreenOptions options;
  options.maxPasses = 1;
  return solveGreen(shape, options);
}

// Largest rho |G| of the layer itself at points of every triangle.
double denselySampled(const GreenFunction& green, std::size_t pointsInEach) {
  const TriMesh& mesh = green.layerMesh();
  std::mt19937 random(3);
  double largest = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const Vec3& x : pointsOf(triangleOf(mesh, t), pointsInEach, random))
      largest = std::max(largest, green.harmonicRadius() * std::abs(greenAt(mesh, green.density(), x)));
  }
  return largest;
}

TEST(Enclosure, HoldsWhatDenseSamplesShow) {
  TriMesh head = smoothStar(2);  // with a step in it, as chins have
  for (Vec3& v : head.vertices) v *= v[2] < -0.2 ? 0.8 : 1;
  for (const StarShape& shape : {starShape(icosphere(2), kPole), starShape(cube(4), Vec3(0.2, 0.1, -0.15)),
                                 starShape(halfBall(5), Vec3(0.1, 0, 0.4)), starShape(head)}) {
    const GreenFunction green = onePass(shape);
    const double seen = denselySampled(green, 60);
    const Enclosure e = enclose(green.layerMesh(), green.density(), green.harmonicRadius(), 60000);
    EXPECT_GE(e.onSurface, seen);
    EXPECT_LE(e.onSurface, 1.7 * seen);
    EXPECT_LE(e.largest, 1.001 * e.onSurface);
    EXPECT_GE(e.largest, 0.8 * seen);
  }
}

TEST(Enclosure, HoldsTheErrorInsideAnOffCenterBall) {
  // On a mesh of the ball the exact answer is that of the polyhedron; the ball's differs from it by what its
  // G is on the chords. Both are known: |G~ - G_ball| <= bound + max of G_ball on the mesh.
  const StarShape shape = starShape(icosphere(4), kPole);
  GreenOptions options;
  options.prove = true;
  const GreenFunction green = solveGreen(shape, options);
  ASSERT_TRUE(green.boundaryError().bound);
  EXPECT_GE(green.boundaryError().max, green.boundaryError().sampled);
  const BallGreen exact{kPole};
  const Frame& frame = shape.frame();
  double chords = 0;
  std::mt19937 random(1);
  for (std::size_t t = 0; t < green.layerMesh().triangles.size(); ++t) {
    for (const Vec3& x : pointsOf(triangleOf(green.layerMesh(), t), 20, random))
      chords = std::max(chords, exact.green(frame.toWorld(x)) * exact.harmonicRadius());
  }
  for (const Vec3& x : pointsInside(shape, 2000)) {
    const Vec3 inner = frame.toInner(x);
    double value;
    Vec3 gradient;
    green.evaluate({&inner, 1}, {&value, 1}, {&gradient, 1});
    const double error = std::abs(value / frame.unit - exact.green(x)) * exact.harmonicRadius();
    EXPECT_LE(error, 1.01 * (green.boundaryError().max + chords));
  }
}

TEST(Enclosure, SeesAWrongDensityThoughItIsWrongAtOneVertexOnly) {
  const GreenFunction green = onePass(starShape(icosphere(3), kPole));
  std::vector<double> density(green.density().begin(), green.density().end());
  const Enclosure before = enclose(green.layerMesh(), density, green.harmonicRadius(), 30000);
  density[100] *= 1.5;
  const Enclosure after = enclose(green.layerMesh(), density, green.harmonicRadius(), 30000);
  EXPECT_GT(after.onSurface, 2 * before.onSurface);
  const Vec3& place = green.layerMesh().vertices[100];
  EXPECT_LT((after.worst - place).norm(), 0.2);
}

TEST(Enclosure, GetsTighterWithMorePoints) {
  const GreenFunction green = onePass(starShape(cube(6), Vec3(0.2, 0.1, -0.15)));
  double before = 1e300;
  for (const std::size_t points : {2000, 8000, 32000}) {
    const Enclosure e = enclose(green.layerMesh(), green.density(), green.harmonicRadius(), points);
    EXPECT_LT(e.onSurface, before);
    before = e.onSurface;
  }
}

TEST(Enclosure, IsKeptByTheRestoredField) {
  GreenOptions options;
  options.prove = true;
  options.maxPasses = 1;
  const GreenFunction green = solveGreen(starShape(icosphere(4), kPole), options);
  ASSERT_TRUE(green.boundaryError().bound);
  const GreenFunction again = restoreGreen(green.shape(), green.sources(), green.record());
  const Vec3 x(0.1, 0.2, -0.3);
  double a, b;
  Vec3 gradient;
  green.evaluate({&x, 1}, {&a, 1}, {&gradient, 1});
  again.evaluate({&x, 1}, {&b, 1}, {&gradient, 1});
  EXPECT_EQ(a, b);
}

TEST(Enclosure, IsTheLayersAlone) {
  GreenOptions options;
  options.prove = true;
  options.solver = GreenSolver::mfs;
  EXPECT_THROW(solveGreen(starShape(icosphere(2)), options), Error);
}

TEST(Enclosure, OfARealModel) {
  POLESTAR_REQUIRE_MESHES();
  GreenOptions options;
  options.prove = true;
  const GreenFunction green =
      solveGreen(testing::starShapeFromFile(*testing::meshFolder() / "castalia.obj"), options);
  const BoundaryError& error = green.boundaryError();
  ASSERT_TRUE(error.bound);
  EXPECT_LE(error.sampled, error.max);
  EXPECT_LE(error.max, 8 * error.sampled);
}

}  // namespace
}  // namespace polestar::detail
