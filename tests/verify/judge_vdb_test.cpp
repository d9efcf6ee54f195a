// Maps that are known exactly hold; every way to spoil one is refused, and for its own reason.
#include "verify/judge_vdb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "analytic_ball.h"

namespace polestar::testing {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using verify::Report;
using verify::VoxelSolid;

const Vec3 kPole(0.3, 0.1, -0.2);

std::vector<std::string> failures(const Report& report) {
  std::vector<std::string> names;
  for (const verify::Check& check : report.checks) {
    if (!check.passed) names.push_back(check.name);
  }
  return names;
}

std::string reason(const Report& report) { return report.holds() ? "" : report.firstFailure()->name; }

/// Directions turned on the sphere, radii kept: only what depends on directions changes.
BallFields withDirections(BallFields fields, const std::function<Vec3(const Vec3&)>& turn) {
  fields.rest = [rest = fields.rest, turn](const Vec3& x) -> Vec3 {
    const Vec3 y = rest(x);
    return y.norm() * turn(y.normalized());
  };
  return fields;
}

Vec3 fromAngles(double polar, double azimuth) {
  return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)};
}
double polarOf(const Vec3& u) { return std::acos(std::clamp(u.z(), -1.0, 1.0)); }
double azimuthOf(const Vec3& u) { return std::atan2(u.y(), u.x()); }

class EverySize : public ::testing::TestWithParam<int> {
 protected:
  Report judged(const BallFields& fields) const { return judgeVdb(voxelize(fields, GetParam())); }
  void expectOnly(const char* name, const Report& report) const {
    EXPECT_THAT(failures(report), ElementsAre(name)) << toText(report);
  }
  void expectReason(const char* name, const Report& report) const {
    EXPECT_EQ(reason(report), name) << toText(report);
  }
};
INSTANTIATE_TEST_SUITE_P(Dims, EverySize, ::testing::Values(32, 64));

TEST_P(EverySize, ExactMapsHold) {
  for (const Vec3& pole : {Vec3(0, 0, 0), Vec3(0.2, 0, 0), kPole}) {
    const Report report = judged(exactBall(pole));
    EXPECT_THAT(failures(report), IsEmpty()) << toText(report);
    EXPECT_NEAR(report.find("degree")->value, 1, 0.01);
    EXPECT_LT(report.find("pole")->value, 0.1);
    EXPECT_LT(report.find("harmonic")->value, 1e-3);
    EXPECT_LT(report.find("field_lines")->value, 1.5);
    EXPECT_EQ(report.find("cells")->value, 0);
  }
}

TEST_P(EverySize, Folded) {
  // Azimuth goes back and forth; every sphere is still covered once in the sum.
  const Report report = judged(withDirections(exactBall(kPole), [](const Vec3& u) {
    const double azimuth = azimuthOf(u);
    return fromAngles(polarOf(u), azimuth + 0.5 * std::sin(3 * azimuth));
  }));
  expectReason("cells", report);
  EXPECT_GT(report.find("cells")->value, 10);
  EXPECT_TRUE(report.find("degree")->passed) << toText(report);
}

TEST_P(EverySize, DoubleCover) {
  const Report report = judged(withDirections(
      exactBall(kPole), [](const Vec3& u) { return fromAngles(polarOf(u), 2 * azimuthOf(u)); }));
  expectReason("degree", report);
  EXPECT_NEAR(report.find("degree")->value, 2, 0.2);
}

TEST_P(EverySize, Mirrored) {
  const Report report =
      judged(withDirections(exactBall(kPole), [](const Vec3& u) { return Vec3(u.x(), u.y(), -u.z()); }));
  expectReason("degree", report);
  EXPECT_NEAR(report.find("degree")->value, -1, 0.02);
}

TEST_P(EverySize, HalfBall) {
  // Lines and levels are as they should be, but the flat face does not go to the sphere.
  BallFields fields = exactBall(Vec3::Zero());
  fields.surface = [](const Vec3& x) { return std::max(x.norm() - 1, -0.2 - x.z()); };
  EXPECT_THAT(failures(judged(fields)), ElementsAre("boundary_everywhere", "coverage"));
}

TEST_P(EverySize, MissingCap) {
  BallFields fields = exactBall(Vec3::Zero());
  fields.surface = [](const Vec3& x) { return std::max(x.norm() - 1, x.x() - 0.55); };
  EXPECT_THAT(failures(judged(fields)), ElementsAre("boundary_everywhere", "coverage"));
}

TEST_P(EverySize, MissingCapThatTheSurfaceDoesNotAdmit) {
  VoxelSolid whole = voxelize(exactBall(Vec3::Zero()), GetParam()), solid = whole;
  solid.box.clear(), solid.rest.clear(), solid.green.clear(), solid.surface.clear();
  for (std::size_t v = 0; v < whole.count(); ++v) {
    const bool stays = whole.rest[v].x < 0.7f;
    solid.slot[whole.box[v]] = stays ? static_cast<std::int32_t>(solid.count()) : -1;
    if (!stays) continue;
    solid.box.push_back(whole.box[v]);
    solid.rest.push_back(whole.rest[v]);
    solid.green.push_back(whole.green[v]);
    solid.surface.push_back(whole.surface[v]);
  }
  expectReason("surface", judgeVdb(solid));
}

TEST_P(EverySize, TornOpen) {
  // The solid is whole, its directions leave a part of the sphere out: somewhere it has to tear.
  const Report report = judged(withDirections(
      exactBall(kPole), [](const Vec3& u) { return fromAngles(0.8 * polarOf(u), azimuthOf(u)); }));
  expectReason("cells", report);
}

TEST_P(EverySize, StraightRaysInsteadOfFieldLines) {
  BallFields fields = exactBall(kPole);
  fields.rest = [rest = fields.rest](const Vec3& x) -> Vec3 {
    return rest(x).norm() * (x - kPole).normalized();
  };
  const Report report = judged(fields);
  EXPECT_THAT(failures(report), ElementsAre("field_lines", "no_straight_rays")) << toText(report);
}

TEST_P(EverySize, WrongPole) {
  VoxelSolid solid = voxelize(exactBall(kPole), GetParam());
  solid.center.x += 2;
  const Report report = judgeVdb(solid);
  expectReason("pole", report);
  EXPECT_NEAR(report.find("pole")->value, 2, 0.2);
}

TEST_P(EverySize, Shifted) {
  // rest belongs one and a half voxels further.
  BallFields fields = exactBall(kPole);
  const double h = 2.0 / GetParam();
  fields.rest = [rest = fields.rest, h](const Vec3& x) {
    return rest((x + Vec3(0, 1.5 * h, 0)) / (1 + 1.5 * h));
  };
  const Report report = judged(fields);
  expectReason("pole", report);
  EXPECT_FALSE(report.find("radius")->passed) << toText(report);
}

TEST_P(EverySize, NotHarmonic) {
  // G goes to 0 at the surface and to infinity at the pole, but Poisson's equation has a right-hand side.
  BallFields fields = exactBall(Vec3::Zero());
  fields.green = [](const Vec3& x) { return 1 / x.norm() - 1 + 0.2 * (1 - x.squaredNorm()); };
  fields.harmonicRadius = 1 / 0.8;
  fields.rest = [green = fields.green](const Vec3& x) -> Vec3 {
    return x.normalized() / (1 + green(x) / 0.8);
  };
  const Report report = judged(fields);
  EXPECT_THAT(failures(report), ElementsAre("harmonic", "harmonic_nearly_everywhere")) << toText(report);
  EXPECT_GT(report.find("harmonic")->value, 3 * report.find("harmonic")->limit);
}

TEST_P(EverySize, WrongRadius) {
  BallFields fields = exactBall(kPole);
  fields.rest = [rest = fields.rest](const Vec3& x) -> Vec3 {
    return std::pow(rest(x).norm(), 0.1) * rest(x);
  };
  EXPECT_THAT(failures(judged(fields)), Contains("radius"));
  EXPECT_EQ(reason(judged(fields)), "radius");
}

TEST_P(EverySize, ThePapersRadiusOnABodyOfAnotherScale) {
  // R = 1/(1 + G) where the harmonic radius is 0.86, and metadata to match.
  BallFields fields = exactBall(kPole);
  fields.harmonicRadius = 1;
  fields.rest = [rest = fields.rest, green = fields.green](const Vec3& x) -> Vec3 {
    return rest(x).normalized() / (1 + green(x));
  };
  expectOnly("harmonic_radius", judged(fields));
}

TEST_P(EverySize, RestBeyondOne) {
  VoxelSolid solid = voxelize(exactBall(kPole), GetParam());
  std::size_t outermost = 0;
  for (std::size_t v = 0; v < solid.count(); ++v) {
    if (solid.surface[v] > solid.surface[outermost]) outermost = v;
  }
  auto& rest = solid.rest[outermost];
  const float scale = 1.001f / std::sqrt(rest.x * rest.x + rest.y * rest.y + rest.z * rest.z);
  rest = {scale * rest.x, scale * rest.y, scale * rest.z};
  expectReason("range", judgeVdb(solid));
}

TEST_P(EverySize, OneCellTurnedOver) {
  // One voxel moves across the opposite side of a cell; its radius stays.
  const int dim = GetParam(), at = dim / 4;
  VoxelSolid solid = voxelize(exactBall(Vec3::Zero()), dim);
  const auto voxel = [&](int i, int j, int k) {
    return static_cast<std::size_t>(solid.slot[solid.boxIndex(i, j, k)]);
  };
  const auto& far = solid.rest[voxel(at + 2, dim / 2, dim / 2 + 2)];
  auto& moved = solid.rest[voxel(at, dim / 2, dim / 2)];
  const auto norm = [](const verify::Vec3f& v) { return length(toDouble(v)); };
  const auto scale = static_cast<float>(norm(moved) / norm(far));
  moved = {scale * far.x, scale * far.y, scale * far.z};
  const Report report = judgeVdb(solid);
  expectOnly("cells", report);
  EXPECT_LE(report.find("cells")->value, 8);
}

TEST_P(EverySize, BoundaryDetached) {
  // The surface lies well inside the place where G vanishes.
  BallFields fields = exactBall(kPole);
  fields.surface = [](const Vec3& x) { return x.norm() - 0.8; };
  expectReason("boundary", judged(fields));
}

TEST(JudgeVdb, ValuesThatAreNone) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinite = std::numeric_limits<float>::infinity();
  const VoxelSolid good = voxelize(exactBall(Vec3::Zero()), 16);
  VoxelSolid solid = good;
  solid.rest[100].y = nan;
  EXPECT_THAT(failures(judgeVdb(solid)), ElementsAre("finite"));
  solid = good;
  solid.green[200] = infinite;
  EXPECT_THAT(failures(judgeVdb(solid)), ElementsAre("finite"));
  solid = good;
  solid.notFiniteSurface = 1;
  EXPECT_THAT(failures(judgeVdb(solid)), ElementsAre("finite"));
  solid = good;
  solid.surface[300] = -infinite;
  EXPECT_THAT(failures(judgeVdb(solid)), ElementsAre("finite"));
  solid = good;
  solid.undefinedRest = 3;
  EXPECT_THAT(failures(judgeVdb(solid)), ElementsAre("defined"));
  solid = good;
  solid.transformFault = "grid rest has another transform than surface";
  EXPECT_THAT(failures(judgeVdb(solid)), ElementsAre("transform"));
  solid = good;
  solid.harmonicRadius = nan;
  EXPECT_THAT(failures(judgeVdb(solid)), ElementsAre("finite"));
  solid = good;
  solid.center.x = -7;
  EXPECT_EQ(reason(judgeVdb(solid)), "pole");
}

TEST(JudgeVdb, MetadataNextToNothing) {
  const VoxelSolid good = voxelize(exactBall(kPole), 32);
  constexpr double kTiny = 1e-300;
  VoxelSolid solid = good;
  solid.harmonicRadius = kTiny;
  EXPECT_EQ(reason(judgeVdb(solid)), "harmonic_radius");
  solid = good;
  solid.center = {kTiny, kTiny, kTiny};
  EXPECT_EQ(reason(judgeVdb(solid)), "pole");
  solid = good;
  solid.greenCap = kTiny;
  EXPECT_EQ(reason(judgeVdb(solid)), "green_range");
}

TEST(JudgeVdb, OtherRadiiNeedOnlyRiseFromThePoleToTheSurface) {
  BallFields fields = exactBall(kPole);
  fields.rest = [rest = fields.rest](const Vec3& x) -> Vec3 {
    const Vec3 y = rest(x);
    return (0.8 + 0.2 * y.norm()) * y;
  };
  VoxelSolid solid = voxelize(fields, 48);
  EXPECT_EQ(reason(judgeVdb(solid)), "radius");
  solid.radiusIsOfGreen = false;
  const Report report = judgeVdb(solid);
  EXPECT_THAT(failures(report), IsEmpty()) << toText(report);
  // A radius that is no function of G.
  fields.rest = [rest = fields.rest](const Vec3& x) -> Vec3 {
    const Vec3 y = rest(x);
    return (1 - 0.05 * (1 - y.norm()) * y.x()) * y;
  };
  solid = voxelize(fields, 48);
  solid.radiusIsOfGreen = false;
  EXPECT_EQ(reason(judgeVdb(solid)), "radius");
}

TEST(JudgeVdb, TheCoreIsNotAskedForFieldLines) {
  // Turned by an angle that falls to 0 at R = 1/4: no field lines below, as in a smooth core.
  BallFields fields = exactBall(kPole);
  fields.rest = [rest = fields.rest](const Vec3& x) -> Vec3 {
    const Vec3 y = rest(x);
    const double angle = 2 * std::max(0.0, 0.6 - y.norm());
    return {std::cos(angle) * y.x() - std::sin(angle) * y.y(),
            std::sin(angle) * y.x() + std::cos(angle) * y.y(), y.z()};
  };
  VoxelSolid solid = voxelize(fields, 48);
  solid.coreRadius = 0.6;
  EXPECT_THAT(failures(judgeVdb(solid)), IsEmpty());
}

}  // namespace
}  // namespace polestar::testing
