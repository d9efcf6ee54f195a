#include "polestar/green/detail/sign_enclosure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "green/densities.h"
#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/green/detail/gradient_sums.h"
#include "polestar/green/detail/layer_majorants.h"
#include "polestar/green/detail/slope_variation.h"
#include "polestar/green/detail/triangle_layer.h"
#include "polestar/mesh/principal_axes.h"
#include "polestar/mesh/shapes.h"
#include "support/layer_potential.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar::detail {
namespace {

using testing::layerPotential;
using testing::needles;
using testing::roughDensity;
using testing::smoothDensity;
using testing::starShape;

const Vec3 kPole(0.3, 0.2, -0.1);

std::shared_ptr<const AlignedSurface> aligned(const TriMesh& mesh) {
  return std::make_shared<const AlignedSurface>(mesh, principalAxes(mesh), Context::quiet());
}

TriMesh moved(TriMesh mesh, const Vec3& pole) {
  for (Vec3& v : mesh.vertices) v -= pole;
  return mesh;
}

// The layer and the pole, triangle by triangle.
Vec3 exactSlope(const TriMesh& mesh, const LayerJumps& jumps, std::span<const double> density,
                const Vec3& x) {
  Vec3 sum = -x / std::pow(x.norm(), 3);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& c = mesh.triangles[t];
    sum += layerGradient(flatTriangle(mesh, jumps, t), {density[c[0]], density[c[1]], density[c[2]]},
                         jumps.slope[t], x);
  }
  return sum;
}

Vec3 pointOf(const Piece& piece, std::mt19937& random) {
  std::array<double, 3> weight{};
  for (double& w : weight) w = -std::log(1 - std::uniform_real_distribution<double>()(random));
  if (random() % 2) weight[random() % 3] *= 1e-3;
  return (weight[0] * piece[0] + weight[1] * piece[1] + weight[2] * piece[2]) /
         (weight[0] + weight[1] + weight[2]);
}

Piece triangleOf(const TriMesh& mesh, std::size_t t, double delta) {
  return {(1 - delta) * mesh.corner(t, 0), (1 - delta) * mesh.corner(t, 1), (1 - delta) * mesh.corner(t, 2)};
}

TEST(TriangleLayer, IsTheSlopeOfThePotential) {
  const TriMesh mesh = moved(halfBall(2), Vec3(0.1, 0.05, 0.4));
  const std::vector<double> density = roughDensity(mesh);
  const LayerJumps jumps(mesh, density);
  std::mt19937 random(1);
  for (int i = 0; i < 60; ++i) {
    const Vec3 x =
        (i % 2 ? 0.97 : 1.4) * pointOf(triangleOf(mesh, random() % mesh.triangles.size(), 0), random);
    constexpr double kStep = 1e-5;
    Vec3 difference;
    for (int k = 0; k < 3; ++k) {
      difference[k] = (layerPotential(mesh, density, x + kStep * Vec3::Unit(k)) -
                       layerPotential(mesh, density, x - kStep * Vec3::Unit(k))) /
                      (2 * kStep);
    }
    EXPECT_LT((exactSlope(mesh, jumps, density, x) + x / std::pow(x.norm(), 3) - difference).norm(), 1e-6);
  }
}

TEST(TriangleLayer, HasTheSecondDerivativesThatBoundsAreDerivedFrom) {
  // docs/method.md, "The signs": one triangle, whose sides all are edges with one side.
  TriMesh mesh;
  mesh.vertices = {{0.1, 0, 0.2}, {1, 0.3, -0.1}, {0.2, 0.9, 0.4}};
  mesh.triangles = {{0, 1, 2}};
  const std::vector<double> density{0.3, -0.7, 0.5};
  const LayerJumps jumps(mesh, density);
  const FlatTriangle flat = flatTriangle(mesh, jumps, 0);
  const Vec3 &n = flat.normal, &g = jumps.slope[0];
  const auto slope = [&](const Vec3& x) { return layerGradient(flat, {0.3, -0.7, 0.5}, g, x); };
  for (const Vec3& x : {Vec3(0.4, 0.3, 0.9), Vec3(0.5, 0.4, -0.4), Vec3(1.4, 1, 0.3)}) {
    const double doubleLayer = -n.dot(layerGradient(flat, {1, 1, 1}, Vec3::Zero(), x));
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 t = Vec3::Unit(axis);
      Vec3 byParts = -doubleLayer * (t.dot(g) * n + t.dot(n) * g);
      for (int k = 0; k < 3; ++k) {
        Vec3 c = Vec3::Zero();
        double e = 0;
        constexpr int kSteps = 4000;
        for (int i = 0; i < kSteps; ++i) {
          const double s = (i + 0.5) / kSteps, step = flat.length[k] / kSteps;
          const Vec3 offset = x - (1 - s) * flat.corner[k] - s * flat.corner[(k + 1) % 3];
          c -= step * ((1 - s) * density[k] + s * density[(k + 1) % 3]) * offset / std::pow(offset.norm(), 3);
          e += step / offset.norm();
        }
        const Vec3& nu = flat.conormal[k];
        byParts -= t.dot(nu) * c + t.dot(n) * (n.dot(c) * nu - nu.dot(c) * n);
        byParts -= e * (t.dot(g) * nu - t.dot(n) * g.dot(nu) * n);
      }
      constexpr double kStep = 1e-5;
      const Vec3 difference = (slope(x + kStep * t) - slope(x - kStep * t)) / (2 * kStep);
      EXPECT_LT((byParts - difference).norm(), 1e-6) << x.transpose() << ' ' << axis;
    }
  }
}

TEST(FlatPieceTest, DistancesToSegmentsAreThoseOfTheirPoints) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto point = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  for (int trial = 0; trial < 300; ++trial) {
    const Piece piece{point(), point(), point()};
    const Vec3 a = point(),
               b = trial % 3 ? point() : Vec3(a + piece[1] - piece[0]);  // some parallel to a side
    const double distance = distanceBetween(piece, a, b);
    double least = 1e300;
    constexpr int kSteps = 24;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const Vec3 p = piece[0] + (i * (piece[1] - piece[0]) + j * (piece[2] - piece[0])) / kSteps;
        const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
        least = std::min(least, (a + along * (b - a) - p).norm());
      }
    }
    EXPECT_LE(distance, least + 1e-12);
    EXPECT_GE(distance, least - 3.5 / kSteps);
  }
}

TEST(TruncationBound, HoldsForGradientsAtEveryOrderAndIsNotIdle) {
  for (const bool dense : {false, true}) {
    std::vector<Vec3> places = icosphere(5).vertices;
    for (Vec3& p : places) p = p.cwiseProduct(Vec3(1, 0.6, 0.3));
    if (dense) {
      for (const Vec3& p : icosphere(4).vertices) places.push_back(Vec3(1, 0, 0) + 1e-2 * p);
    }
    PointCharges charges;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> strength(dense ? -1 : 0.2, 1);
    for (const Vec3& p : places) {
      charges.x.push_back(p[0]);
      charges.y.push_back(p[1]);
      charges.z.push_back(p[2]);
      charges.charge.push_back(strength(random) / static_cast<double>(places.size()));
    }
    charges.squaredSoftening = 1e-24;
    std::vector<Vec3> points;
    for (const Vec3& p : places) points.push_back(0.995 * p + Vec3(1e-3, 2e-3, 0));
    std::vector<Vec3> exact(points.size()), fast(points.size());
    std::vector<double> value(points.size());
    DirectChargeField(charges).evaluate(points, value, exact, Context::quiet());
    const GradientSums sums(charges, points);
    for (const int order : {6, 10, 16, 22}) {
      sums.evaluate(order, fast, Context::quiet());
      const std::vector<double> bound = sums.truncation(order);
      double worstError = 0, worstBound = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double error = (fast[i] - exact[i]).norm();
        ASSERT_LE(error, bound[i] + 1e-13 * exact[i].norm() + 1e-13) << order << ' ' << i;
        worstError = std::max(worstError, error);
        worstBound = std::max(worstBound, bound[i]);
      }
      EXPECT_LT(worstBound, 1e5 * worstError) << order;
    }
  }
}

TEST(LayerMajorants, BoundTheQuadratureErrorOfGradients) {
  for (const TriMesh& mesh : {moved(icosphere(2), 0.3 * kPole), moved(cube(6), kPole), needles()}) {
    for (const std::vector<double>& density : {roughDensity(mesh), smoothDensity(mesh)}) {
      const LayerQuadrature quadrature(mesh, Context::quiet());
      const LayerJumps jumps(mesh, density);
      const LayerMajorants majorants(mesh, quadrature, density, jumps);
      PointCharges charges = quadrature.places();
      charges.charge = quadrature.chargesFor(density);
      std::mt19937 random(2);
      double largest = 0, largestBound = 0;
      for (int i = 0; i < 200; ++i) {
        const Piece piece = triangleOf(mesh, random() % mesh.triangles.size(), 0);
        const Vec3 x = (1 - std::pow(10, -3 * std::uniform_real_distribution<double>()(random))) *
                       pointOf(piece, random);
        double value = 0;
        Vec3 slope = Vec3::Zero();
        DirectChargeField(charges).evaluate({&x, 1}, {&value, 1}, {&slope, 1}, Context::quiet());
        quadrature.addNearGradient({&x, 1}, quadrature.near().density(density), {&value, 1}, {&slope, 1},
                                   Context::quiet());
        const Vec3 exact = exactSlope(mesh, jumps, density, x) + x / std::pow(x.norm(), 3);
        const double error = (slope - exact).norm(), bound = majorants.slopeQuadratureError({x, 0});
        EXPECT_LE(error, bound + 1e-10);
        EXPECT_LE(bound, majorants.slopeQuadratureError({x + Vec3(0.01, 0, 0), 0.02}) * (1 + 1e-9));
        largest = std::max(largest, error);
        largestBound = std::max(largestBound, bound);
      }
      EXPECT_GT(largest, 0.002 * largestBound) << "a bound that far off is not worth much";
    }
  }
}

TEST(LayerMajorants, ClosedFormsFartherOutLeaveLessToTheCharges) {
  const TriMesh mesh = moved(icosphere(4), kPole);
  const std::vector<double> density = roughDensity(mesh);
  const LayerQuadrature quadrature(mesh, Context::quiet());
  const LayerJumps jumps(mesh, density);
  const LayerMajorants majorants(mesh, quadrature, density, jumps);
  const Vec3 x = 0.99 * mesh.corner(100, 0);
  double before = majorants.slopeQuadratureError({x, 0});
  std::size_t triangles = 0;
  for (const double reach : {2.0, 4.0, 8.0}) {
    const LayerMajorants::Reached reached = majorants.reachedFrom(x, reach);
    EXPECT_LT(reached.slopeError, 0.5 * before);
    EXPECT_GT(reached.triangles.size(), triangles);
    before = reached.slopeError;
    triangles = reached.triangles.size();
  }
}

TEST(SlopeVariation, IsNeverBelowWhatAPieceShows) {
  for (const TriMesh& mesh : {moved(icosphere(1), 0.3 * kPole), moved(icosphere(2), kPole),
                              moved(cube(3), kPole), moved(halfBall(3), Vec3(0.02, 0.01, 0.4)), needles()}) {
    for (const std::vector<double>& density : {roughDensity(mesh), smoothDensity(mesh)}) {
      const LayerQuadrature quadrature(mesh, Context::quiet());
      const LayerJumps jumps(mesh, density);
      const LayerMajorants majorants(mesh, quadrature, density, jumps);
      const SlopeVariation variation(mesh, density, jumps, majorants);
      std::mt19937 random(11);
      double tightest = 0;
      for (int trial = 0; trial < 12; ++trial) {
        const std::size_t t = random() % mesh.triangles.size();
        Piece piece = triangleOf(mesh, t, std::pow(10, -1 - 3 * (trial % 4) / 3.0));
        // Not only parallel to the surface.
        if (trial % 3 == 0) piece[0] *= 0.97;
        SlopePatch patch = variation.patch(piece);
        for (int level = 0; level < 7; ++level) {
          const double bound = patch.variation(piece);
          std::array<Vec3, 3> corner;
          for (int k = 0; k < 3; ++k) corner[k] = exactSlope(mesh, jumps, density, piece[k]);
          for (int i = 0; i < 8; ++i) {
            std::array<double, 3> w{};
            double sum = 0;
            for (double& weight : w)
              sum += weight = std::pow(std::uniform_real_distribution<double>()(random), 1 + i % 3);
            const Vec3 x = (w[0] * piece[0] + w[1] * piece[1] + w[2] * piece[2]) / sum;
            const Vec3 linear = (w[0] * corner[0] + w[1] * corner[1] + w[2] * corner[2]) / sum;
            const double deviation = (exactSlope(mesh, jumps, density, x) - linear).norm();
            ASSERT_LE(deviation, bound + 1e-10) << t << ' ' << level;
            tightest = std::max(tightest, deviation / bound);
          }
          patch = patch.narrowed(piece);
          piece = quartersOf(piece)[random() % 4];
        }
      }
      EXPECT_GT(tightest, 0.02);
    }
  }
}

TEST(SlopeVariation, FallsLikeTheAreaOfPieces) {
  const TriMesh mesh = moved(icosphere(3), kPole);
  const std::vector<double> density = smoothDensity(mesh);
  const LayerQuadrature quadrature(mesh, Context::quiet());
  const LayerJumps jumps(mesh, density);
  const LayerMajorants majorants(mesh, quadrature, density, jumps);
  Piece piece = triangleOf(mesh, 100, 1e-2);
  const SlopePatch patch = SlopeVariation(mesh, density, jumps, majorants).patch(piece);
  const double whole = patch.variation(piece);
  for (int level = 0; level < 5; ++level) piece = quartersOf(piece)[3];
  EXPECT_LT(patch.variation(piece), 0.02 * whole);
}

GreenFunction onePass(const StarShape& shape) {
  GreenOptions options;
  options.maxPasses = 1;
  return solveGreen(shape, options);
}

SignProof enclose(const TriMesh& mesh, std::span<const double> density, double delta) {
  const LayerField field(aligned(mesh), density, 1e-6, Context::quiet());
  return encloseSigns(field, {.delta = delta, .points = 20 * mesh.triangles.size() + 50000},
                      Context::quiet());
}

struct Cosines {
  double radial = -1, normal = -1;
};

// The largest at points of every face, by closed forms.
Cosines denselySampled(const TriMesh& mesh, std::span<const double> density, double delta, int pointsInEach) {
  const LayerJumps jumps(mesh, density);
  std::mt19937 random(3);
  Cosines largest;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int i = 0; i < pointsInEach; ++i) {
      const Vec3 x = pointOf(triangleOf(mesh, t, delta), random), slope = exactSlope(mesh, jumps, density, x);
      largest.radial = std::max(largest.radial, x.dot(slope) / (x.norm() * slope.norm()));
      largest.normal = std::max(largest.normal, jumps.normal[t].dot(slope) / slope.norm());
    }
  }
  return largest;
}

TEST(SignEnclosure, HoldsWhatDenseSamplesShow) {
  TriMesh chin = smoothStar(2);  // with a step in it
  for (Vec3& v : chin.vertices) v *= v[2] < -0.2 ? 0.8 : 1;
  const std::vector<StarShape> shapes{
      starShape(icosphere(2), kPole), starShape(halfBall(4), Vec3(0.1, 0, 0.4)),
      starShape(cube(4), Vec3(0.2, 0.1, -0.15)), starShape(smoothStar(2)), starShape(chin)};
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const GreenFunction green = onePass(shapes[i]);
    for (const double delta : {1e-3, 1e-2, 5e-2}) {
      const SignProof proof = enclose(green.layerMesh(), green.density(), delta);
      const Cosines seen = denselySampled(green.layerMesh(), green.density(), delta, 4);
      EXPECT_GE(proof.radial.worst, seen.radial) << i << ' ' << delta;
      EXPECT_GE(proof.normal.worst, seen.normal) << i << ' ' << delta;
      EXPECT_EQ(proof.faces, green.layerMesh().triangles.size());
      EXPECT_EQ(proof.radial.failed == 0, proof.radial.worst < 0);
      EXPECT_GE(proof.radial.failed, proof.radial.refuted);
    }
  }
}

TEST(SignEnclosure, LeavesBallsAndStarsNoCriticalPoint) {
  for (const StarShape& shape : {starShape(icosphere(4), kPole), starShape(smoothStar(4))}) {
    const GreenFunction green = onePass(shape);
    const SignProof proof = enclose(green.layerMesh(), green.density(), 1e-3);
    EXPECT_TRUE(proof.proved());
    EXPECT_EQ(proof.normal.failed, 0u);
    EXPECT_TRUE(proof.weakest.empty());
    EXPECT_LT(proof.points, 20 * proof.faces);
  }
}

TEST(SignEnclosure, DoesNotProveAGreenFunctionThatWasTamperedWith) {
  const GreenFunction green = onePass(starShape(icosphere(4), kPole));
  const TriMesh& mesh = green.layerMesh();
  std::vector<double> density(green.density().begin(), green.density().end());
  ASSERT_TRUE(enclose(mesh, density, 2e-3).proved());
  // A layer of the other sign, and more than twice as strong: what lies below it is pushed inwards.
  density[100] *= -4;
  const SignProof proof = enclose(mesh, density, 2e-3);
  EXPECT_FALSE(proof.proved());
  EXPECT_GE(proof.radial.refuted, 3u);
  EXPECT_LE(proof.radial.failed, 24u) << "its ring, and the next one at most";
  EXPECT_GT(proof.radial.worst, 0);
  ASSERT_FALSE(proof.weakest.empty());
  for (const SignProof::Face& face : proof.weakest) {
    EXPECT_LT((face.place - mesh.vertices[100]).norm(), 0.15);
    EXPECT_GE(face.radial, face.seen);
  }
}

TEST(SignEnclosure, SeesTheWrongSignInAWholeCap) {
  const GreenFunction green = onePass(starShape(icosphere(4)));
  const TriMesh& mesh = green.layerMesh();
  std::vector<double> density(green.density().begin(), green.density().end());
  for (std::size_t i = 0; i < density.size(); ++i) density[i] *= mesh.vertices[i][2] > 0.8 ? -4 : 1;
  const SignProof proof = enclose(mesh, density, 1e-2);
  std::size_t within = 0, touched = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    int corners = 0;
    for (int k = 0; k < 3; ++k) corners += mesh.corner(t, k)[2] > 0.8;
    within += corners == 3;
    touched += corners > 0;
  }
  EXPECT_GE(proof.radial.refuted, within);
  EXPECT_LE(proof.radial.failed, 2 * touched);
  EXPECT_GT(proof.weakest.front().seen, 0.5);
}

TEST(SignEnclosure, LooksAheadAtSingleFaces) {
  const GreenFunction green = onePass(starShape(icosphere(3), kPole));
  const TriMesh& mesh = green.layerMesh();
  std::vector<double> density(green.density().begin(), green.density().end());
  density[100] *= -4;
  const LayerField field(aligned(mesh), density, 1e-6, Context::quiet());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); t += 37) {
    const bool touches =
        std::find(mesh.triangles[t].begin(), mesh.triangles[t].end(), 100) != mesh.triangles[t].end();
    const bool far = (mesh.corner(t, 0) - mesh.vertices[100]).norm() > 0.5;
    const bool holds = radialSignHolds(field, {.delta = 2e-3, .points = 5000}, {&t, 1}, Context::quiet());
    if (touches || far) {
      EXPECT_EQ(holds, far) << t;
    }
  }
}

TEST(SignEnclosure, RunsOutOfPointsWithoutAProof) {
  const GreenFunction green = onePass(starShape(smoothStar(3)));
  const LayerField field(aligned(green.layerMesh()), green.density(), 1e-6, Context::quiet());
  const std::size_t vertices = green.layerMesh().vertices.size();
  const SignProof proof = encloseSigns(field, {.delta = 1e-3, .points = vertices + 10}, Context::quiet());
  EXPECT_FALSE(proof.proved());
  EXPECT_EQ(proof.radial.refuted, 0u);
  EXPECT_LE(proof.points, vertices + 10);
}

TEST(SignEnclosure, IsTheSameForAnyNumberOfThreads) {
  const GreenFunction green = onePass(starShape(cube(8), kPole));
  SignProof one, four;
  withThreads(1, [&] { one = enclose(green.layerMesh(), green.density(), 1e-2); });
  withThreads(4, [&] { four = enclose(green.layerMesh(), green.density(), 1e-2); });
  EXPECT_EQ(one.points, four.points);
  EXPECT_EQ(one.radial.failed, four.radial.failed);
  EXPECT_EQ(one.radial.worst, four.radial.worst);
  EXPECT_EQ(one.normal.worst, four.normal.worst);
  ASSERT_EQ(one.weakest.size(), four.weakest.size());
  for (std::size_t i = 0; i < one.weakest.size(); ++i) {
    EXPECT_EQ(one.weakest[i].triangle, four.weakest[i].triangle);
    EXPECT_EQ(one.weakest[i].radial, four.weakest[i].radial);
    EXPECT_EQ(one.weakest[i].place, four.weakest[i].place);
  }
}

TEST(SignEnclosure, CanBeCancelled) {
  const GreenFunction green = onePass(starShape(icosphere(3)));
  const LayerField field(aligned(green.layerMesh()), green.density(), 1e-6, Context::quiet());
  Context context;
  context.cancel();
  EXPECT_THROW(encloseSigns(field, {}, context), Error);
}

TEST(SignEnclosure, IsPartOfWhatIsProved) {
  GreenOptions options;
  options.maxPasses = 1;
  const StarShape shape = starShape(icosphere(3), kPole);
  EXPECT_TRUE(solveGreen(shape, options).record().signs.empty());
  options.prove = true;
  const GreenFunction green = solveGreen(shape, options);
  ASSERT_FALSE(green.record().signs.empty());
  EXPECT_EQ(green.record().signs.front().delta, 1e-3);
  EXPECT_TRUE(green.record().signs.back().proved());
  for (std::size_t i = 0; i + 1 < green.record().signs.size(); ++i)
    EXPECT_FALSE(green.record().signs[i].proved());
}

TEST(SignEnclosure, OfARealModel) {
  POLESTAR_REQUIRE_MESHES();
  const GreenFunction green = onePass(testing::starShapeFromFile(*testing::meshFolder() / "castalia.obj"));
  const SignProof proof = enclose(green.layerMesh(), green.density(), 2e-2);
  EXPECT_TRUE(proof.proved()) << proof.radial.failed << " of " << proof.faces;
  EXPECT_EQ(proof.radial.refuted, 0u);
  EXPECT_LT(proof.points, 20 * proof.faces);
}

}  // namespace
}  // namespace polestar::detail
