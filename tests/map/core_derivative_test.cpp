// What the two cores are for: a derivative at the center, or field lines all the way down to it.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "polestar/map/detail/core_isotopy.h"
#include "polestar/mesh/bodies.h"
#include "polestar/pipeline.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::starShape;
using testing::starShapeFromFile;

/// Spread evenly over the sphere, by the golden angle.
std::vector<Vec3> evenDirections(int count) {
  std::vector<Vec3> directions;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    directions.emplace_back(std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle),
                            z);
  }
  return directions;
}

/// Root mean square over directions d of what the linear map closest to all of them leaves of the quotients
/// (f(c + t d) - f(c)) / t, relative to theirs.
double deviationFromLinear(const VolumeMap& map, const Vec3& center, double t) {
  const std::vector<Vec3> directions = evenDirections(300);
  std::vector<Vec3> x, quotient(directions.size());
  for (const Vec3& d : directions) x.push_back(center + t * d);
  map.forward(x, quotient);  // f(c) = 0
  Mat3 products = Mat3::Zero(), squares = Mat3::Zero();
  for (std::size_t i = 0; i < directions.size(); ++i) {
    quotient[i] /= t;
    products += quotient[i] * directions[i].transpose();
    squares += directions[i] * directions[i].transpose();
  }
  const Mat3 linear = products * squares.inverse();
  double left = 0, all = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    left += (quotient[i] - linear * directions[i]).squaredNorm();
    all += quotient[i].squaredNorm();
  }
  return std::sqrt(left / all);
}

/// A head on its neck, 2,562 vertices.
class CoreOfAHead : public ::testing::Test {
 protected:
  static const GreenChart& chart() {
    static const GreenChart made = traceChart(solveGreen(starShape(stylizedHead(16))));
    return made;
  }
  static const StarShape& shape() { return chart().green().shape(); }
  static BallMap mapWith(CoreMode core) {
    static const SphereMap phi = conformalSphereMap(shape());
    BallMapOptions options;
    options.core = core;
    return BallMap(chart(), phi, options);
  }
  /// At distances of `radii` from the center, as shares of the harmonic radius: there R is about that.
  static std::vector<double> deviations(const VolumeMap& map, const std::vector<double>& radii) {
    const double unit = chart().green().harmonicRadius() * shape().frame().unit;
    std::vector<double> result;
    for (const double r : radii) result.push_back(deviationFromLinear(map, shape().frame().origin, r * unit));
    return result;
  }
  static void print(const char* name, const std::vector<double>& values) {
    std::printf("%-16s", name);
    for (const double value : values) std::printf(" %9.2e", value);
    std::printf("\n");
  }
};

TEST_F(CoreOfAHead, TheSmoothOneHasADerivativeAtTheCenterAndThePapersHasNone) {
  const BallMap smooth = mapWith(CoreMode::smooth), paper = mapWith(CoreMode::paper);
  ASSERT_EQ(smooth.options().core, CoreMode::smooth) << smooth.coreFallbackReason();
  const std::vector<double> radii{0.32, 0.16, 0.08, 0.04, 0.02, 0.01, 0.005};
  const std::vector<double> ofSmooth = deviations(TracedBallMap(smooth), radii),
                            ofPaper = deviations(TracedBallMap(paper), radii);
  print("R", radii);
  print("smooth", ofSmooth);
  print("smooth, table", deviations(smooth, radii));
  print("paper", ofPaper);
  print("paper, table", deviations(paper, radii));
  // Below a quarter of the core's radius f is a rotation of R omega, and R omega is linear but for terms of
  // the third degree: half the distance, a quarter of the deviation.
  for (std::size_t i = 4; i < radii.size(); ++i)
    EXPECT_NEAR(ofSmooth[i - 1] / ofSmooth[i], 4, 0.2) << "R = " << radii[i];
  // A of the direction, at all distances: it is no rotation, and nothing linear comes near it.
  EXPECT_GT(ofPaper.back(), 0.1);
  EXPECT_NEAR(ofPaper.back() / ofPaper[2], 1, 0.01);
}

TEST_F(CoreOfAHead, WherePhiIsOmegaThePapersCoreIsSmooth) {
  // A is the identity but for the interpolation of phi between vertices: the kink of the paper's core is that
  // of A, not of following field lines.
  const BallMap map(chart(), fieldLineSphereMap(shape(), chart().directions()));
  ASSERT_EQ(map.options().core, CoreMode::paper);
  const std::vector<double> radii{0.16, 0.04, 0.01, 0.0025};
  const std::vector<double> deviation = deviations(TracedBallMap(map), radii);
  print("R", radii);
  print("field-line", deviation);
  EXPECT_LT(deviation.back(), 3e-4);
}

/// Flipped triangles of A_R, by exact predicates, over radii spread evenly in ln R from the rotation to A.
std::size_t flipsOfCore(std::span<const Vec3> omega, std::span<const Vec3> phi,
                        std::span<const double> weight, double coreRadius,
                        const std::vector<Triangle>& triangles) {
  constexpr int kLevels = 64;
  const detail::CoreIsotopy isotopy(omega, phi, weight, coreRadius);
  std::size_t flips = 0;
  std::vector<Vec3> image(phi.size());
  for (int level = 0; level <= kLevels; ++level) {
    const double radius = coreRadius * std::pow(0.25, static_cast<double>(level) / kLevels);
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = isotopy.direction(radius, omega[i], phi[i]);
    flips += countFlips(image, triangles);
  }
  return flips;
}

TEST(CoreOfRealMeshes, FlipsNoTriangleAtAnyLevel) {
  POLESTAR_REQUIRE_MESHES();
  for (const std::string& name : testing::chosenModels(
           {"itokawa_16.obj", "yorp.stl"}, {"castalia.obj", "itokawa_radar.obj", "psyche.obj", "KW4Alpha.obj",
                                            "geographos.ply", "sylvia.off"})) {
    const StarShape given = starShapeFromFile(*testing::meshFolder() / name);
    const BallMap map = mapToBall(given);
    EXPECT_EQ(map.options().core, CoreMode::smooth) << name << ": " << map.coreFallbackReason();
    EXPECT_EQ(map.levelFlips(), 0u) << name;
    EXPECT_EQ(map.imageCells().bad(), 0u) << name;
    const TriMesh& mesh = map.chart().green().shape().mesh();
    const std::span<const Vec3> omega = map.chart().directions();
    const std::vector<double> area = vertexAreas(mesh);
    EXPECT_EQ(flipsOfCore(omega, map.sphere().directions, area, map.options().coreRadius, mesh.triangles), 0u)
        << name;
    // The count sees flips where there are some: no straight way leads from a rotation to a map that winds
    // the parallels around each other.
    std::vector<Vec3> wound;
    for (const Vec3& w : omega)
      wound.push_back(Eigen::AngleAxisd(std::numbers::pi * w[2], Vec3::UnitZ()) * w);
    EXPECT_GT(flipsOfCore(omega, wound, area, map.options().coreRadius, mesh.triangles), 0u) << name;
  }
}

}  // namespace
}  // namespace polestar
