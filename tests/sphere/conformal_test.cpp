#include "polestar/sphere/detail/conformal.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/dirichlet.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/moebius.h"
#include "polestar/sphere/detail/sphere_quality.h"
#include "support.h"

namespace polestar {
namespace {

using detail::radialMap;
using testing::largestDifference;
using testing::largestDifferenceUpToRotation;
using testing::rotated;
using testing::someRotation;

SphereMap conformal(const TriMesh& mesh) {
  SphereMap map = detail::conformalMap(mesh, {}, Context::quiet());
  EXPECT_EQ(map.fallbackReason, "");
  EXPECT_EQ(map.kind, SphereMapKind::conformal);
  EXPECT_EQ(map.flips, 0u);
  EXPECT_EQ(countFlips(map.directions, mesh.triangles), 0u);
  return map;
}

TriMesh ellipsoid(int levels) {
  return transformed(icosphere(levels), [](const Vec3& v) { return Vec3(2 * v[0], v[1], 0.7 * v[2]); });
}

TEST(RadialMap, IsTheDirections) {
  const TriMesh mesh = smoothStar(2);
  const SphereMap map = radialMap(mesh);
  EXPECT_LT(largestDifference(map.directions, icosphere(2).vertices), 1e-15);
  EXPECT_EQ(map.flips, 0u);
  EXPECT_EQ(map.kind, SphereMapKind::radial);
  EXPECT_GT(map.qcMean, 1.1);
}

TEST(ConformalMap, OfARoundSphereIsTheIdentity) {
  // Triangles of very different size: a Moebius image of the icosphere. Its vertices lie on the unit sphere,
  // so the map is the identity up to the triangles' size, squared.
  double last = 0;
  for (const int level : {3, 4, 5}) {
    TriMesh mesh = icosphere(level);
    detail::moebiusTranslate(mesh.vertices, Vec3(0.2, 0.3, -0.1));
    const double error = largestDifference(conformal(mesh).directions, mesh.vertices);
    EXPECT_LT(error, 0.3 * std::pow(0.25, level - 2));
    if (level > 3) {
      EXPECT_GT(last / error, 3) << "level " << level;
    }
    last = error;
  }
}

TEST(ConformalMap, DoesNotDependOnTheCenter) {
  // Seen from another center the surface is the same: only the start and the final rotation differ.
  const TriMesh centered = icosphere(4);
  const std::vector<Vec3> reference = conformal(centered).directions;
  const Vec3 shift(0.5, -0.4, 0.3);
  const TriMesh mesh = transformed(centered, [&](const Vec3& v) { return Vec3(v - shift); });
  EXPECT_LT(largestDifferenceUpToRotation(conformal(mesh).directions, reference), 1e-8);
  EXPECT_GT(largestDifferenceUpToRotation(radialMap(mesh).directions, reference),
            0.3);  // the start was far away
}

/// Conformal image of a spheroid with radii (equator, equator, pole) on the sphere: meridians stay, the
/// isometric latitude q becomes that of the sphere, sin(latitude) = tanh q. [Snyder 1987, "conformal
/// latitude"]
Vec3 spheroidImage(const Vec3& v, double equator, double pole) {
  const double ratio = pole / equator;
  const double sine =
      std::sin(std::atan2(v[2], ratio * ratio * std::hypot(v[0], v[1])));  // of the geodetic latitude
  const double e = std::sqrt(std::abs(1 - ratio * ratio));
  const double q = std::atanh(std::clamp(sine, -1 + 1e-15, 1 - 1e-15)) -
                   (ratio < 1 ? e * std::atanh(e * sine) : -e * std::atan(e * sine));
  const double angle = std::atan2(v[1], v[0]);
  return {std::cos(angle) / std::cosh(q), std::sin(angle) / std::cosh(q), std::tanh(q)};
}

TEST(ConformalMap, OfSpheroidsIsTheConformalLatitude) {
  for (const double pole : {0.5, 2.0}) {
    double last = 0;
    for (const int level : {3, 4, 5}) {
      // Turned before stretching: no vertex on the axis, no symmetry between mesh and body.
      const TriMesh mesh = transformed(icosphere(level), [&](const Vec3& v) {
        const Vec3 w = someRotation() * v;
        return Vec3(w[0], w[1], pole * w[2]);
      });
      std::vector<Vec3> exact;
      for (const Vec3& v : mesh.vertices) exact.push_back(spheroidImage(v, 1, pole));
      const SphereMap map = conformal(mesh);
      const double error = largestDifferenceUpToRotation(map.directions, exact);
      EXPECT_LT(error, 0.4 * std::pow(0.25, level - 2)) << "pole " << pole << " level " << level;
      if (level > 3) {
        EXPECT_GT(last / error, 3) << "pole " << pole << " level " << level;
      }
      last = error;
      // The body is symmetric about its axis, so the alignment with the radial map is the identity but for
      // the mesh.
      EXPECT_LT(largestDifference(map.directions, exact), 4 * error + 1e-3);
    }
  }
}

TEST(ConformalMap, AnglesConvergeUnderRefinement) {
  for (const auto& make :
       {+[](int level) { return ellipsoid(level); }, +[](int level) { return smoothStar(level); }}) {
    double last = 0;
    for (const int level : {3, 4, 5}) {
      const TriMesh mesh = make(level);
      const SphereMap map = conformal(mesh);
      EXPECT_LT(map.qcMean, 0.5 * (1 + radialMap(mesh).qcMean));
      if (mesh.vertices.size() > 5000) {
        EXPECT_LE(map.qcMean, 1.05);
        EXPECT_LE(map.qcMax, 1.1);
      }
      if (level > 3) {
        EXPECT_GT((last - 1) / (map.qcMean - 1), 1.8) << "level " << level;
      }
      last = map.qcMean;
    }
  }
}

TEST(ConformalMap, IsMassCentered) {
  for (const TriMesh& mesh : {smoothStar(4), ellipsoid(3)}) {
    const SphereMap map = conformal(mesh);
    const std::vector<double> shares = detail::vertexAreaShares(mesh);
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = 0; i < shares.size(); ++i) {
      mean += shares[i] * map.directions[i];
      EXPECT_NEAR(map.directions[i].norm(), 1, 1e-15);
    }
    EXPECT_LT(mean.norm(), 1e-10);
  }
}

TEST(ConformalMap, IsAlignedWithTheRadialMap) {
  const TriMesh mesh = smoothStar(3);
  const std::vector<Vec3> directions = conformal(mesh).directions;
  const Mat3 turn = bestRotation(directions, radialMap(mesh).directions, detail::vertexAreaShares(mesh));
  EXPECT_LT((turn - Mat3::Identity()).norm(), 1e-12);
}

TEST(ConformalMap, TurnsWithTheShapeAndIgnoresItsSize) {
  for (const TriMesh& mesh : {smoothStar(4), ellipsoid(4), cube(10)}) {
    const std::vector<Vec3> reference = conformal(mesh).directions;
    const TriMesh turned =
        transformed(mesh, [](const Vec3& v) { return Vec3(1.7e-3 * (someRotation() * v)); });
    EXPECT_LT(largestDifference(conformal(turned).directions, rotated(someRotation(), reference)), 1e-8);
  }
}

TEST(ConformalMap, RoundedVerticesMoveItByNoMoreThanTheRounding) {
  for (const TriMesh& mesh : {smoothStar(5), ellipsoid(4), cube(16)}) {
    const TriMesh turned = transformed(mesh, [](const Vec3& v) { return Vec3(someRotation() * v); });
    const TriMesh rounded =
        transformed(turned, [](const Vec3& v) { return Vec3(v.cast<float>().cast<double>()); });
    ASSERT_GT(largestDifference(turned.vertices, rounded.vertices), 2e-8);
    EXPECT_LT(largestDifference(conformal(turned).directions, conformal(rounded).directions), 1e-6);
  }
}

TEST(ConformalMap, DoesNotDependOnTheOrderOfVerticesAndTriangles) {
  const TriMesh mesh = smoothStar(4);
  std::mt19937 random(5);
  std::vector<std::int32_t> place(mesh.vertices.size());
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), random);
  TriMesh shuffled = mesh;
  for (std::size_t i = 0; i < place.size(); ++i) shuffled.vertices[place[i]] = mesh.vertices[i];
  for (Triangle& t : shuffled.triangles) {
    for (std::int32_t& v : t) v = place[v];
    std::rotate(t.begin(), t.begin() + random() % 3, t.end());
  }
  std::shuffle(shuffled.triangles.begin(), shuffled.triangles.end(), random);
  const std::vector<Vec3> directions = conformal(shuffled).directions, reference = conformal(mesh).directions;
  std::vector<Vec3> back;
  for (const std::int32_t p : place) back.push_back(directions[p]);
  EXPECT_LT(largestDifference(back, reference), 1e-8);
}

TEST(ConformalMap, SameBytesForAnyNumberOfThreads) {
  const TriMesh mesh = smoothStar(5);
  std::vector<std::vector<Vec3>> results;
  for (const int threads : {1, 2, 5})
    withThreads(threads, [&] { results.push_back(conformal(mesh).directions); });
  EXPECT_TRUE(results[0] == results[1]);
}

TEST(ConformalMap, IsTheMinimizerAndNotWhereTheDescentStopped) {
  const TriMesh mesh = ellipsoid(4);
  const std::vector<double> shares = detail::vertexAreaShares(mesh);
  const detail::DirichletEnergy energy(detail::intrinsicDelaunayLaplacian(mesh), shares, mesh.vertices);
  auto minimize = [&](std::vector<Vec3> start) {
    const auto result = detail::descendOnSpheres(energy, start, {}, Context::quiet());
    EXPECT_TRUE(result.converged);
    detail::centerByMoebius(start, shares);
    return start;
  };
  const std::vector<Vec3> reference = minimize(radialMap(mesh).directions);
  std::vector<Vec3> start = reference;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (Vec3& s : start) s = (s + 0.02 * Vec3(normal(random), normal(random), normal(random))).normalized();
  detail::moebiusTranslate(start, Vec3(0.3, 0.2, -0.4));
  EXPECT_GT(largestDifferenceUpToRotation(start, reference), 0.3);
  EXPECT_LT(largestDifferenceUpToRotation(minimize(start), reference), 1e-8);
}

TEST(DirichletEnergy, GradientIsTheDerivative) {
  const TriMesh mesh = ellipsoid(2);
  const detail::DirichletEnergy energy(detail::intrinsicDelaunayLaplacian(mesh),
                                       detail::vertexAreaShares(mesh), mesh.vertices);
  const std::vector<Vec3> points = radialMap(mesh).directions;
  std::vector<Vec3> gradient(points.size());
  EXPECT_EQ(energy.evaluate(points, gradient), energy.evaluate(points, {}));
  for (const std::size_t i : {0u, 17u, 100u}) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<Vec3> ahead = points, behind = points;
      ahead[i][axis] += 1e-5;
      behind[i][axis] -= 1e-5;
      const double slope = (energy.evaluate(ahead, {}) - energy.evaluate(behind, {})) / 2e-5;
      EXPECT_NEAR(gradient[i][axis], slope, 1e-8);
    }
  }
}

TEST(ConformalMap, OfRegularBodiesIsRadial) {
  // Corners on a sphere, faces alike: nothing is distorted by chords, however few.
  for (const TriMesh& mesh : {cube(1), icosphere(0)}) {
    const SphereMap map = conformal(mesh);
    EXPECT_NEAR(map.qcMean, 1, 1e-6);
    EXPECT_LT(largestDifference(map.directions, radialMap(mesh).directions), 1e-6);
  }
  EXPECT_EQ(conformal(cube(3)).repairedVertices, 0u) << "found the usual way";
}

TEST(ConformalMap, WithoutInnerVerticesIsFoundWithoutFlips) {
  // Lids without inner vertices: the harmonic map draws their rims together to points.
  const TriMesh mesh = transformed(testing::drum(60, 3),
                                   [](const Vec3& v) { return Vec3(2 * v[0], v[1] + 0.1 * v[2], v[2]); });
  const SphereMap map = conformal(mesh);
  EXPECT_LT(map.qcMean, radialMap(mesh).qcMean - 0.01);
  EXPECT_EQ(map.repairedVertices, mesh.vertices.size());
  const TriMesh turned = transformed(mesh, [](const Vec3& v) { return Vec3(someRotation() * v); });
  EXPECT_LT(largestDifference(conformal(turned).directions, rotated(someRotation(), map.directions)), 1e-4);
}

TEST(ConformalMap, NeedlesOnACoarseBodyDoNotFlip) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const TriMesh mesh = testing::withNeedles(testing::drum(12, 0.4), 40, 1e-3, seed);
    ASSERT_EQ(radialMap(mesh).flips, 0u);
    conformal(mesh);
  }
}

TEST(ConformalMap, WhereTheDescentStopsTheFlipFreeOneGoesOn) {
  ConformalOptions options;
  options.maxIterations = 2;
  Context context;
  std::string info;
  context.onLog = [&](LogLevel level, std::string_view message) {
    if (level == LogLevel::info) info = message;
  };
  const TriMesh mesh = ellipsoid(3);
  const SphereMap map = detail::conformalMap(mesh, options, context);
  EXPECT_NE(info.find("2 iterations"), std::string::npos) << info;
  EXPECT_EQ(map.kind, SphereMapKind::conformal);
  EXPECT_EQ(map.flips, 0u);
  // Another discrete conformal map of the same surface.
  EXPECT_LT(largestDifference(map.directions, conformal(mesh).directions), 0.02);
  EXPECT_NEAR(map.qcMean, conformal(mesh).qcMean, 0.01);
}

TEST(ConformalMap, CanBeCancelledAndChecksItsOptions) {
  Context context;
  context.cancel();
  EXPECT_THROW(detail::conformalMap(smoothStar(3), {}, context), Error);
  ConformalOptions options;
  options.tolerance = 0;
  EXPECT_THROW(options.validate(), Error);
  options = {};
  options.maxIterations = 0;
  EXPECT_THROW(options.validate(), Error);
}

}  // namespace
}  // namespace polestar
