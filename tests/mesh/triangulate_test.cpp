#include "polestar/mesh/detail/triangulate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <random>

namespace polestar {
namespace {

using detail::Triangulator;

std::vector<std::int32_t> allOf(const std::vector<Vec3>& points) {
  std::vector<std::int32_t> polygon(points.size());
  std::iota(polygon.begin(), polygon.end(), 0);
  return polygon;
}

std::vector<Triangle> cut(const std::vector<Vec3>& points) {
  std::vector<Triangle> triangles;
  EXPECT_TRUE(Triangulator(points)(allOf(points), triangles));
  return triangles;
}

Vec3 areaOf(const std::vector<Vec3>& points, const Triangle& t) {
  return 0.5 * (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
}

/// Half of Newell's sum: the polygon's area vector, without any triangulation.
Vec3 areaOf(const std::vector<Vec3>& points) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) sum += points[i].cross(points[(i + 1) % points.size()]);
  return 0.5 * sum;
}

/// A triangulation of a flat simple polygon: n - 2 triangles, none turned, whose areas add up to the
/// polygon's.
void expectTriangulation(const std::vector<Vec3>& points) {
  const std::vector<Triangle> triangles = cut(points);
  ASSERT_EQ(triangles.size(), points.size() - 2);
  const Vec3 whole = areaOf(points), normal = whole.normalized();
  double sum = 0;
  for (const Triangle& t : triangles) {
    EXPECT_GE(areaOf(points, t).dot(normal), -1e-12 * whole.norm());
    sum += areaOf(points, t).norm();
  }
  EXPECT_NEAR(sum, whole.norm(), 1e-9 * whole.norm());
}

std::vector<Vec3> tilted(std::vector<Vec3> points) {
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized();
  for (Vec3& p : points) p = turn * p + Vec3(10, -20, 5);
  return points;
}

std::vector<Vec3> comb(int teeth) {
  std::vector<Vec3> points{{2.0 * teeth, -1, 0}, {2.0 * teeth, 0, 0}};
  for (int i = teeth - 1; i >= 0; --i) {
    points.push_back({2.0 * i + 1.2, 5, 0});
    points.push_back({2.0 * i + 0.8, 0.01 * (i % 7), 0});
  }
  points.push_back({0, -1, 0});
  return points;
}

TEST(Triangulate, DentedQuadIsCutThroughItsDent) {
  // Corner 0 is reflex: only the diagonal 0-2 lies inside.
  const std::vector<Vec3> dart{{0.9, 0.9, 0}, {0, 3, 0}, {0, 0, 0}, {3, 0, 0}};
  for (int shift = 0; shift < 4; ++shift) {
    std::vector<Vec3> points = dart;
    std::rotate(points.begin(), points.begin() + shift, points.end());
    expectTriangulation(points);
    expectTriangulation(tilted(points));
  }
}

TEST(Triangulate, BentQuadIsCutWhereItsHalvesAgree) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> offset(-0.4, 0.4);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Vec3> quad{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    for (Vec3& p : quad) p += Vec3(offset(random), offset(random), offset(random));
    const auto agreement = [&](const Triangle& a, const Triangle& b) {
      return areaOf(quad, a).normalized().dot(areaOf(quad, b).normalized());
    };
    const std::vector<Triangle> chosen = cut(quad);
    const double best = std::max(agreement({0, 1, 2}, {0, 2, 3}), agreement({0, 1, 3}, {1, 2, 3}));
    EXPECT_GE(agreement(chosen[0], chosen[1]), best - 1e-6);
  }
}

TEST(Triangulate, FlatQuadsDoNotHangOnRounding) {
  // A square and its turned copies are cut along the same corners.
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(cut(square), cut(tilted(square)));
  const std::vector<Vec3> lozenge{{-3, 0, 0}, {0, -1, 0}, {3, 0, 0}, {0, 1, 0}};
  for (const Triangle& t : cut(lozenge)) EXPECT_EQ(std::count(t.begin(), t.end(), 1), 1);
}

TEST(Triangulate, SimplePolygons) {
  std::vector<Vec3> regular, star, spiral;
  for (int i = 0; i < 64; ++i) {
    const double a = 2 * std::numbers::pi * i / 64;
    regular.push_back({std::cos(a), std::sin(a), 0});
    star.push_back((i % 2 ? 0.2 : 1.0) * Vec3(std::cos(a), std::sin(a), 0));
  }
  for (int i = 0; i <= 100; ++i)
    spiral.push_back((1 + 0.05 * i) * Vec3(std::cos(0.2 * i), std::sin(0.2 * i), 0));
  for (int i = 100; i >= 0; --i)
    spiral.push_back((1.3 + 0.05 * i) * Vec3(std::cos(0.2 * i), std::sin(0.2 * i), 0));
  for (const auto& points :
       {regular, star, spiral, comb(40),
        std::vector<Vec3>{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}}}) {
    expectTriangulation(points);
    expectTriangulation(tilted(points));
    std::vector<Vec3> reversed(points.rbegin(), points.rend());
    expectTriangulation(reversed);
  }
}

TEST(Triangulate, CollinearCornersAndCrossingsStillGiveClosedSurfaces) {
  EXPECT_EQ(cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {0, 2, 0}}).size(), 4u);
  EXPECT_EQ(cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}}).size(), 3u);
  EXPECT_EQ(cut({{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 2, 0}, {1, 5, 0}}).size(), 3u);
  EXPECT_EQ(cut(std::vector<Vec3>(6, Vec3(1, 1, 1))).size(), 4u);
  // Each outer side lies on one triangle, each diagonal on two: what surrounds the polygon stays closed.
  std::vector<Vec3> tangle;
  for (int i = 0; i < 41; ++i)
    tangle.push_back({std::cos(7.0 * i * i), std::sin(3.0 * i), 0.1 * std::cos(i)});
  std::map<std::pair<int, int>, int> uses;
  for (const Triangle& t : cut(tangle)) {
    for (int k = 0; k < 3; ++k) {
      ++uses[{t[k], t[(k + 1) % 3]}];
      --uses[{t[(k + 1) % 3], t[k]}];
    }
  }
  for (const auto& [side, balance] : uses) {
    const bool outer = (side.first + 1) % 41 == side.second, inner = (side.second + 1) % 41 == side.first;
    EXPECT_EQ(balance, outer ? 1 : inner ? -1 : 0);
  }
}

TEST(Triangulate, LargeConvexPolygonsAreFastAndWellShaped) {
  std::vector<Vec3> points;
  constexpr int kCorners = 20'000;
  for (int i = 0; i < kCorners; ++i) {
    const double a = 2 * std::numbers::pi * i / kCorners;
    points.push_back({std::cos(a), std::sin(a), 0});
  }
  expectTriangulation(points);
}

TEST(Triangulate, CraftedPolygonsEndInTime) {
  for (const auto& points : {comb(100'000), std::vector<Vec3>(100'000, Vec3(1, 2, 3))}) {
    std::vector<Triangle> triangles;
    const auto start = std::chrono::steady_clock::now();
    Triangulator cutter(points);
    cutter(allOf(points), triangles);  // either outcome is fine, hanging is not
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
  }
}

}  // namespace
}  // namespace polestar
