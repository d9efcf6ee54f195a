// The star test as a whole: bodies with known answers, moved bodies, given centers, bodies without a center.

#include "polestar/star/detail/inspection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "star/bodies.h"
#include "support/exact.h"

namespace polestar::detail {
namespace {

using ::testing::HasSubstr;

StarReport inspect(const TriMesh& mesh, StarOptions options = {}) {
  return inspectMesh(mesh, options, Context::quiet()).report;
}

StarOptions at(const Vec3& center) {
  StarOptions options;
  options.center = center;
  return options;
}

TEST(Inspection, TheCubesCenterIsItsMiddle) {
  const StarReport report = inspect(cube(4));
  EXPECT_TRUE(report.star);
  EXPECT_LT(report.center.norm(), 1e-12);
  EXPECT_NEAR(report.centerMargin, 1, 1e-12);
  EXPECT_NEAR(report.margin, 1, 1e-10);
  EXPECT_NEAR(report.marginRelative, 1 / std::sqrt(12.0), 1e-10);
  EXPECT_EQ(report.badAreaFraction, 0);
  EXPECT_TRUE(report.witnessFaces.empty());
  EXPECT_EQ(report.reason, "");
  EXPECT_EQ(report.rays.count, 10000 + cube(4).triangles.size());
  EXPECT_EQ(report.rays.failed, 0u);
}

TEST(Inspection, AConvexBodysCenterIsItsCentroid) {
  // Volume centroid of a half ball: 3/8 above the disk; the margin there, 3/8, is more than its share.
  const StarReport report = inspect(halfBall(24));
  EXPECT_LT((report.center - Vec3(0, 0, 0.375)).norm(), 2e-3);
}

TEST(Inspection, ACentroidOutsideTheKernelIsPulledInsideToItsShare) {
  // The needle's planes hem the kernel in; the centroid is far from it.
  const TriMesh mesh = testing::spikedCube(30);
  for (const double share : {0.1, 0.25, 0.8}) {
    StarOptions options;
    options.marginShare = share;
    const StarReport report = inspect(mesh, options);
    EXPECT_TRUE(report.star);
    EXPECT_GE(report.centerMargin, share * report.margin * (1 - 1e-9));
    EXPECT_LE(report.centerMargin, report.margin * (1 + 1e-9));
  }
}

struct Motion {
  std::string name;
  Mat3 rotation;
  double scale;
  Vec3 offset;
};

std::vector<Motion> motions() {
  const Mat3 turned = Eigen::AngleAxisd(1.1, Vec3(1, 2, -2).normalized()).toRotationMatrix();
  return {{"turned", turned, 1, Vec3::Zero()},
          {"far", Mat3::Identity(), 1, Vec3(1e6, -2e6, 5e5)},
          {"tiny", Mat3::Identity(), 1e-7, Vec3::Zero()},
          {"huge", turned, 1e12, Vec3::Zero()},
          {"turned, tiny and a thousand sizes away", turned, 1e-7, Vec3(1e-4, 0, -1e-4)}};
}

TEST(Inspection, MovedBodiesGetTheSameAnswer) {
  for (const TriMesh& mesh : {smoothStar(4), testing::spikedCube(30), testing::letterU().mesh}) {
    const StarReport still = inspect(mesh);
    for (const Motion& m : motions()) {
      SCOPED_TRACE(m.name);
      const StarReport moved = inspect(
          transformed(mesh, [&](const Vec3& v) { return Vec3(m.scale * (m.rotation * v) + m.offset); }));
      // What the offset costs the coordinates in digits, the answer may lose too.
      const double tolerance = 1e-9 + 1e-14 * m.offset.norm() / m.scale;
      EXPECT_EQ(moved.star, still.star);
      EXPECT_NEAR(moved.margin / m.scale, still.margin, tolerance);
      if (!still.star) continue;
      EXPECT_NEAR(moved.centerMargin / m.scale, still.centerMargin, tolerance);
      const Vec3 center = m.rotation.transpose() * (moved.center - m.offset) / m.scale;
      EXPECT_LT((center - still.center).norm(), 100 * tolerance);
      EXPECT_EQ(moved.rays.failed, 0u);
    }
  }
}

TEST(Inspection, TheLetterUsWallsAreItsWitnesses) {
  const testing::LetterU u = testing::letterU();
  const StarReport report = inspect(u.mesh);
  EXPECT_FALSE(report.star);
  EXPECT_NEAR(report.margin, -0.5, 1e-10);
  ASSERT_GE(report.witnessFaces.size(), 2u);
  ASSERT_LE(report.witnessFaces.size(), 4u);
  auto in = [](const std::vector<std::int32_t>& wall, std::int32_t f) {
    return f == wall[0] || f == wall[1];
  };
  bool left = false, right = false;
  for (const std::int32_t f : report.witnessFaces) {
    EXPECT_TRUE(in(u.leftWall, f) || in(u.rightWall, f)) << f;
    left |= in(u.leftWall, f);
    right |= in(u.rightWall, f);
  }
  EXPECT_TRUE(left && right);
  // Any point in an arm misses the other arm's wall only: 2 of the area of 30.
  EXPECT_NEAR(report.badAreaFraction, 2.0 / 30, 1e-12);
  EXPECT_GT(report.rays.failed, 0u);
  EXPECT_THAT(report.reason, HasSubstr("not star-shaped"));
  EXPECT_THAT(report.reason, HasSubstr(std::to_string(report.witnessFaces[0])));
  const bool wallNamed = std::abs(report.badPlace[0] - 1) < 1e-12 || std::abs(report.badPlace[0] - 2) < 1e-12;
  EXPECT_TRUE(wallNamed) << report.badPlace.transpose();
}

// Farkas, in rationals: nonnegative weights under which the four normals cancel and the offsets sum to no
// more than 0 leave no point in all four open half-spaces.
bool shareNoPoint(const TriMesh& mesh, const std::vector<std::int32_t>& faces) {
  using testing::Rational;
  std::array<testing::Rational3, 4> normal;
  std::array<Rational, 4> offset;
  for (int k = 0; k < 4; ++k) {
    const auto v = testing::exact(mesh.corner(faces[k], 0));
    normal[k] = testing::cross(testing::difference(testing::exact(mesh.corner(faces[k], 1)), v),
                               testing::difference(testing::exact(mesh.corner(faces[k], 2)), v));
    offset[k] = testing::dot(normal[k], v);
  }
  // Cramer: the weights of the one dependency between four vectors.
  std::array<Rational, 4> weight;
  for (int k = 0; k < 4; ++k) {
    std::array<testing::Rational3, 3> others;
    for (int j = 0, i = 0; j < 4; ++j) {
      if (j != k) others[i++] = normal[j];
    }
    weight[k] = testing::determinant(others[0], others[1], others[2]) * (k % 2 ? -1 : 1);
  }
  const int sign = weight[0].sign();
  Rational sum = 0;
  for (int k = 0; k < 4; ++k) {
    if (sign == 0 || weight[k].sign() != sign) return false;
    sum += sign * weight[k] * offset[k];
  }
  return sum <= 0;
}

TEST(Inspection, WitnessesShareNoPointByRationalArithmetic) {
  int bodies = 0;
  for (const double frequency : {5.0, 7.0, 9.0}) {
    for (const double height : {0.15, 0.3}) {
      const TriMesh mesh = radialShape(4, [&](const Vec3& w) {
        return 1 + height * std::sin(frequency * w[0] + 0.3) * std::cos(frequency * w[1]) + 0.1 * w[2];
      });
      // Sheared sideways over its height, the body hides parts of itself.
      const TriMesh bent =
          transformed(mesh, [](const Vec3& v) { return Vec3(v[0] + 2.5 * v[2] * v[2], v[1], 2 * v[2]); });
      const StarReport report = inspect(bent);
      ASSERT_FALSE(report.star);
      ASSERT_EQ(report.witnessFaces.size(), 4u);
      EXPECT_TRUE(shareNoPoint(bent, report.witnessFaces));
      ++bodies;
    }
  }
  EXPECT_EQ(bodies, 6);
  // The check can fail: four faces of a convex body share its inside.
  EXPECT_FALSE(shareNoPoint(icosphere(2), {0, 40, 80, 120}));
}

TEST(Inspection, AGivenCenterIsTakenWhenItSeesEverything) {
  const Vec3 center(0.9, -0.5, 0.25);
  const StarReport report = inspect(cube(4), at(center));
  EXPECT_TRUE(report.star);
  EXPECT_EQ(report.center, center);
  EXPECT_NEAR(report.centerMargin, 0.1, 1e-12);
  EXPECT_NEAR(report.margin, 1, 1e-10);
}

TEST(Inspection, AGivenCenterThatFailsIsToldByHowMuchAndWhatWouldDo) {
  const Vec3 center(1.25, 0.1, 0.2);
  const StarReport report = inspect(cube(4), at(center));
  EXPECT_FALSE(report.star);
  EXPECT_EQ(report.center, center);
  EXPECT_NEAR(report.centerMargin, -0.25, 1e-12);
  EXPECT_NEAR(report.margin, 1, 1e-10);
  EXPECT_NEAR(report.badAreaFraction, 1.0 / 6, 1e-12);
  EXPECT_TRUE(report.witnessFaces.empty());  // the body itself is star-shaped
  EXPECT_NEAR(report.badPlace[0], 1, 1e-12);
  EXPECT_THAT(report.reason, HasSubstr("(1.25, 0.1, 0.2)"));
  EXPECT_THAT(report.reason, HasSubstr("0.25 behind"));
  EXPECT_THAT(report.reason, HasSubstr("margin of 1."));
}

TEST(Inspection, AGivenCenterInABodyWithoutOne) {
  const StarReport report = inspect(testing::letterU().mesh, at(Vec3(0.5, 0.5, 0.5)));
  EXPECT_FALSE(report.star);
  EXPECT_EQ(report.center, Vec3(0.5, 0.5, 0.5));
  EXPECT_FALSE(report.witnessFaces.empty());
  EXPECT_THAT(report.reason, HasSubstr("No other center"));
}

TEST(Inspection, ACenterOnAFaceIsNotInside) {
  const StarReport report = inspect(cube(4), at(Vec3(1, 0.1, 0.2)));
  EXPECT_FALSE(report.star);
  EXPECT_EQ(report.centerMargin, 0);
}

TEST(Inspection, TwiceAroundIsRefusedForWhatItIs) {
  const StarReport report = inspect(testing::twiceAround());
  EXPECT_FALSE(report.star);
  EXPECT_GT(report.margin, 0);
  EXPECT_THAT(report.reason, HasSubstr("winds 2 times"));
  EXPECT_GT(report.rays.failed, report.rays.count / 2);
}

TEST(Inspection, FacesWithoutAreaAreNamed) {
  // A vertex on an edge, joined by a face without area as some programs close their seams.
  TriMesh mesh = cube(1);
  const Triangle t = mesh.triangles[0];
  const auto middle = static_cast<std::int32_t>(mesh.vertices.size());
  mesh.vertices.push_back((mesh.vertices[t[0]] + mesh.vertices[t[1]]) / 2);
  mesh.triangles[0] = {t[0], middle, t[2]};
  mesh.triangles.push_back({middle, t[1], t[2]});
  mesh.triangles.push_back({t[0], t[1], middle});
  const StarReport report = inspect(mesh);
  EXPECT_FALSE(report.star);
  EXPECT_THAT(report.reason, HasSubstr("no area"));
  EXPECT_THAT(report.reason, HasSubstr("face 13"));
}

TEST(Inspection, TheInnerMeshCarriesTheVerdict) {
  const TriMesh mesh =
      transformed(smoothStar(4), [](const Vec3& v) { return Vec3(1e3 * v + Vec3(1e6, 0, 0)); });
  const Inspection inspection = inspectMesh(mesh, {}, Context::quiet());
  ASSERT_TRUE(inspection.report.star);
  EXPECT_TRUE(testing::seesEveryFace(inspection.inner, Vec3::Zero()));
  EXPECT_TRUE(testing::seesEveryFace(mesh, inspection.report.center));
  EXPECT_EQ(inspection.frame.origin, inspection.report.center);
}

TEST(Inspection, ReportsHaveTheSameBytesForAnyNumberOfThreads) {
  const TriMesh hidden =
      transformed(smoothStar(5), [](const Vec3& v) { return Vec3(v[0] + 2 * v[2] * v[2], v[1], 2 * v[2]); });
  for (const TriMesh& mesh : {smoothStar(5), hidden}) {
    std::vector<StarReport> reports;
    for (const int threads : {1, 2, 2}) {
      withThreads(threads, [&] { reports.push_back(inspect(mesh)); });
    }
    for (const StarReport& r : reports) {
      EXPECT_EQ(r.center, reports[0].center);
      EXPECT_EQ(r.margin, reports[0].margin);
      EXPECT_EQ(r.centerMargin, reports[0].centerMargin);
      EXPECT_EQ(r.badAreaFraction, reports[0].badAreaFraction);
      EXPECT_EQ(r.witnessFaces, reports[0].witnessFaces);
      EXPECT_EQ(r.rays.failed, reports[0].rays.failed);
      EXPECT_EQ(r.reason, reports[0].reason);
    }
  }
}

TEST(Inspection, NoRaysWhenNoneAreWanted) {
  StarOptions options;
  options.rays = 0;
  EXPECT_EQ(inspect(cube(4), options).rays.count, 0u);
}

TEST(Inspection, ImpossibleOptionsAreUsageErrors) {
  for (const double share : {0.0, -0.5, 1.5, std::nan("")}) {
    StarOptions options;
    options.marginShare = share;
    EXPECT_THROW(inspect(cube(1), options), Error);
  }
  StarOptions options;
  options.rays = -1;
  EXPECT_THROW(inspect(cube(1), options), Error);
  EXPECT_THROW(inspect(cube(1), at(Vec3(0, std::nan(""), 0))), Error);
}

TEST(Inspection, StopsWhenCancelled) {
  Context context;
  context.cancel();
  try {
    inspectMesh(cube(4), {}, context);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::cancelled);
  }
}

}  // namespace
}  // namespace polestar::detail
