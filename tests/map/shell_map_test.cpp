// Maps of the ball by tables of the sphere: one to one by proof, inverse and derivative, a rotation in the
// core; and tables that are not one to one, which are refused.
#include "polestar/map/shell_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const Mat3 kTurn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -0.5).normalized()).toRotationMatrix();

/// A twist about z whose angle depends on the height, after a turn.
ShellTable twist(int levels, double angle, const Mat3& turn = kTurn) {
  const TriMesh sphere = icosphere(levels);
  ShellTable table{sphere.vertices, {}, sphere.triangles};
  for (const Vec3& u : table.from)
    table.to.push_back(turn * (Eigen::AngleAxisd(angle * std::sin(2 * u.z()), Vec3::UnitZ()) * u));
  return table;
}

std::vector<Vec3> ballPoints(std::size_t count, double innermost = 0, double outermost = 1) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(innermost, outermost);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(uniform(random) * Vec3(normal(random), normal(random), normal(random)).normalized());
  return points;
}

std::string refusal(ShellTable table, Errc code = Errc::notConverged, double coreRadius = 0.25) {
  try {
    const ShellMap map(std::move(table), coreRadius);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    return error.what();
  }
  return "";
}

TEST(ShellMap, KeepsSpheresAndComesBack) {
  const ShellMap map(twist(4, 0.8));
  std::vector<Vec3> points = ballPoints(20000);
  points.emplace_back(Vec3::Zero());
  for (const Vec3& u : map.table().from) points.push_back(0.2 * u);
  std::vector<Vec3> there(points.size()), back(points.size());
  map.forward(points, there);
  map.inverse(there, back);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double r = points[i].norm();
    EXPECT_NEAR(there[i].norm(), r, 1e-14);
    EXPECT_LT((back[i] - points[i]).norm(), r >= 0.25 ? 1e-12 : 1e-9) << points[i].transpose();
    if (r <= 0.25 / 4) {
      EXPECT_LT((there[i] - map.rotation() * points[i]).norm(), 1e-15);
    }
  }
  map.inverse(points, back);
  map.forward(back, there);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_LT((there[i] - points[i]).norm(), points[i].norm() >= 0.25 ? 1e-12 : 1e-9);
}

TEST(ShellMap, IsItsTableOutsideOfTheCore) {
  const ShellTable table = twist(3, 0.5);
  const ShellMap map(table);
  for (std::size_t i = 0; i < table.from.size(); ++i) {
    EXPECT_LT((map.ofDirection(3 * table.from[i]) - table.to[i]).norm(), 1e-14);
    const Vec3 inside = 0.3 * table.from[i];
    Vec3 image;
    map.forward({&inside, 1}, {&image, 1});
    EXPECT_LT((image - 0.3 * table.to[i]).norm(), 1e-14) << "field lines go to field lines";
  }
  // A turn is found again, and then there is nothing else.
  const ShellMap turn(twist(3, 0));
  EXPECT_LT((turn.rotation() - kTurn).norm(), 1e-14);
  EXPECT_NEAR(turn.largestDilatation(), 1, 1e-9);
  for (const Vec3& x : ballPoints(1000)) {
    Vec3 image;
    turn.forward({&x, 1}, {&image, 1});
    EXPECT_LT((image - kTurn * x).norm(), 1e-14);
  }
}

// The inverse where the triangles are between the two tables must not depend on luck with the walk.
TEST(ShellMap, TheBlendComesBackFromStrongTwists) {
  const ShellMap map(twist(5, 1.3));
  const std::vector<Vec3> points = ballPoints(20000, 0.25 / 4, 0.25);
  std::vector<Vec3> there(points.size()), back(points.size());
  map.forward(points, there);
  map.inverse(there, back);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_LT((back[i] - points[i]).norm(), 1e-9);
}

TEST(ShellMap, JacobianIsTheDerivativeAndNeverTurnsOver) {
  const ShellMap map(twist(3, 0.7));
  const std::vector<Vec3> points = ballPoints(4000, 0.01, 0.999);
  std::vector<Mat3> jacobians(points.size());
  map.jacobian(points, jacobians);
  constexpr double step = 1e-6;
  std::size_t acrossSeams = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Mat3 differences;
    for (int k = 0; k < 3; ++k) {
      const std::array<Vec3, 2> around{points[i] + step * Vec3::Unit(k), points[i] - step * Vec3::Unit(k)};
      std::array<Vec3, 2> images;
      map.forward(around, images);
      differences.col(k) = (images[0] - images[1]) / (2 * step);
    }
    acrossSeams += !((jacobians[i] - differences).norm() < 1e-6 * (1 + jacobians[i].norm()));
    EXPECT_GT(jacobians[i].determinant(), 0);
  }
  // On the seams between triangles there is no derivative: a strip 2e-6 wide along edges of length 0.14.
  EXPECT_LE(acrossSeams, 3u);
}

TEST(ShellMap, TurnsWithItsTables) {
  const ShellMap map(twist(4, 0.8));
  const Mat3 before = Eigen::AngleAxisd(0.7, Vec3(0, 1, 2).normalized()).toRotationMatrix(),
             after = Eigen::AngleAxisd(2.1, Vec3(3, 1, 0).normalized()).toRotationMatrix();
  ShellTable turned = map.table();
  for (Vec3& u : turned.from) u = before * u;
  for (Vec3& u : turned.to) u = after * u;
  const ShellMap other(turned);
  for (const Vec3& x : ballPoints(2000)) {
    const Vec3 moved = before * x;
    Vec3 a, b;
    map.forward({&x, 1}, {&a, 1});
    other.forward({&moved, 1}, {&b, 1});
    EXPECT_LT((after * a - b).norm(), 1e-12);
  }
}

TEST(ShellMap, SameBytesForAnyNumberOfThreads) {
  const ShellMap map(twist(4, 0.8));
  const std::vector<Vec3> points = ballPoints(5000);
  std::vector<Vec3> one(points.size()), many(points.size());
  withThreads(1, [&] { map.inverse(points, one); });
  map.inverse(points, many);
  EXPECT_EQ(one, many);
}

TEST(ShellMap, RefusesAFoldedTable) {
  ShellTable table = twist(3, 0.5);
  // One vertex beyond its neighbours.
  table.to[17] = -table.to[17];
  EXPECT_THAT(refusal(table), AllOf(HasSubstr("not one to one"), HasSubstr("folded, 6 in the table itself")));
  ShellTable mirrored = twist(3, 0.2);
  for (Vec3& u : mirrored.to) u.x() = -u.x();
  EXPECT_THAT(refusal(mirrored), HasSubstr("1280 of 1280"));
}

/// z -> z^2 about the z axis: every triangle positive but at the poles, the sphere covered twice.
TEST(ShellMap, RefusesATableThatCoversTheSphereTwice) {
  const TriMesh sphere = icosphere(4);
  const auto squared = [](const Vec3& u) {
    const double angle = 2 * std::atan2(u.y(), u.x()), across = std::hypot(u.x(), u.y());
    return Vec3(across * std::cos(angle), across * std::sin(angle), u.z());
  };
  ShellTable to{sphere.vertices, {}, sphere.triangles};
  for (const Vec3& u : sphere.vertices) to.to.push_back(squared(u));
  EXPECT_THAT(refusal(to), HasSubstr("not one to one"));
  ShellTable from{{}, sphere.vertices, sphere.triangles};
  for (const Vec3& u : sphere.vertices) from.from.push_back(squared(u));
  EXPECT_THAT(refusal(from), HasSubstr("in `from`"));
}

// One to one itself, but from pole to pole it twists by more than a whole turn, so that some places are
// turned by half a one against the rest: every straight way to a rotation leads through a fold.
TEST(ShellMap, RefusesWhatTheCoreCannotUndo) {
  const TriMesh sphere = icosphere(5);
  ShellTable table{sphere.vertices, {}, sphere.triangles};
  for (const Vec3& u : sphere.vertices)
    table.to.push_back(Eigen::AngleAxisd(1.1 * std::numbers::pi * u.z(), Vec3::UnitZ()) * u);
  EXPECT_EQ(countFlips(table.to, table.triangles), 0u);
  const std::vector<FoldedTriangle> folded = foldedTriangles(table, coreRotation(table));
  EXPECT_GT(folded.size(), 0u);
  for (const FoldedTriangle& f : folded) {
    EXPECT_GT(f.share, 0);
    EXPECT_LT(f.share, 1);
  }
  EXPECT_THAT(refusal(table),
              AllOf(HasSubstr("0 in the table itself"), HasSubstr("on the way to a rotation")));
}

TEST(ShellMap, RefusesAntipodesOnTheWay) {
  // Half way between Q u and -Q u there is nothing.
  const TriMesh sphere = icosphere(2);
  ShellTable table{sphere.vertices, {}, sphere.triangles};
  const Mat3 half = Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitZ()).toRotationMatrix();
  for (const Vec3& u : sphere.vertices) table.to.push_back(half * u);
  EXPECT_TRUE(foldedTriangles(table, half).empty());
  EXPECT_EQ(foldedTriangles(table, Mat3::Identity()).size(), sphere.triangles.size());
}

TEST(ShellMap, RefusesWhatIsNoTable) {
  const ShellTable good = twist(2, 0.3);
  ShellTable table = good;
  table.to.pop_back();
  EXPECT_THAT(refusal(table, Errc::usage), HasSubstr("162 vertices on one side and 161"));
  table = good;
  table.to[3].setZero();
  EXPECT_THAT(refusal(table, Errc::usage), HasSubstr("vertex 3"));
  table = good;
  table.triangles[0][1] = 162;
  EXPECT_THAT(refusal(table, Errc::usage), HasSubstr("does not exist"));
  EXPECT_THAT(refusal(good, Errc::usage, 1.0), HasSubstr("core"));
  table = good;
  table.triangles.pop_back();
  EXPECT_THAT(refusal(table), HasSubstr("no sphere"));
  const ShellMap map(good);
  const Vec3 outside(1.1, 0, 0);
  Vec3 image;
  map.forward({&outside, 1}, {&image, 1});
  EXPECT_TRUE(image.hasNaN());
  map.inverse({&outside, 1}, {&image, 1});
  EXPECT_TRUE(image.hasNaN());
}

}  // namespace
}  // namespace polestar
