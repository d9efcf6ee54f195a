#include "polestar/render/detail/solid_scene.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <random>
#include <set>

#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/render/detail/staging.h"

namespace polestar::detail {
namespace {

constexpr double kCrease = 0.9;

class Random {
 public:
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(generator_()) / 4294967296.0);
  }
  Vec3 point(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
  Vec3 direction() { return point(1).normalized(); }

 private:
  std::mt19937 generator_{11};
};

struct Ray {
  Vec3 origin, direction;
};

/// What is left when the region on the outer side of all planes is cut away.
Piece notched(const std::vector<Plane>& planes) {
  Piece piece;
  piece.notched = !planes.empty();
  for (const Plane& plane : planes) piece.planes.push_back({-plane.normal, -plane.offset});
  return piece;
}

/// A hit in double precision, with what the tests ask of it.
struct Hit {
  SceneHit scene;
  double distance;
  Vec3 position, normal, shadingNormal, shadowOrigin;
};

Hit firstHit(const SolidScene& scene, const Ray& ray) {
  RayBundle rays;
  rays.add(ray.origin.cast<float>(), ray.direction.cast<float>());
  Hit hit;
  scene.firstHits(rays, {&hit.scene, 1});
  hit.distance = static_cast<double>(hit.scene.distance);
  if (hit.scene.none()) return hit;
  hit.position =
      scene.solidPoint(hit.scene, ray.origin, ray.direction) + scene.pieces()[hit.scene.piece].shift;
  const ShadingPoint point = scene.shadingPoint(hit.scene, rays.originOf(0), rays.directionOf(0));
  hit.normal = point.normal.cast<double>();
  hit.shadingNormal = point.shadingNormal.cast<double>();
  hit.shadowOrigin = point.shadowOrigin.cast<double>();
  return hit;
}

bool occluded(const SolidScene& scene, const Ray& ray) {
  RayBundle rays;
  rays.add(ray.origin.cast<float>(), ray.direction.cast<float>());
  std::uint8_t blocked[2];
  scene.occluded(rays, true, {&blocked[0], 1});
  scene.occluded(rays, false, {&blocked[1], 1});
  EXPECT_EQ(blocked[0], blocked[1]);
  return blocked[0];
}

/// Inside the cube [-1, 1]^3 and not cut away.
bool left(const Vec3& p, const std::vector<Plane>& planes) {
  bool away = !planes.empty();
  for (const Plane& plane : planes) away = away && plane.normal.dot(p) > plane.offset;
  return p.cwiseAbs().maxCoeff() < 1 && !away;
}

/// Where a ray first enters what is left, by short steps: slow, and knows nothing of intervals.
std::optional<double> marched(const Ray& ray, const std::vector<Plane>& planes, double from = 0) {
  for (double t = from; t < 12; t += 1e-3) {
    if (left(ray.origin + t * ray.direction, planes)) return t;
  }
  return std::nullopt;
}

std::vector<std::vector<Plane>> someCuts() {
  const Vec3 a = Vec3(1, 0.3, 0.1).normalized(), b = Vec3(-0.2, -1, 0.3).normalized(),
             c = Vec3(0, 0.2, 1).normalized();
  return {{}, {{a, 0.1}}, {{a, -0.1}, {b, 0.05}}, {{a, 0}, {b, -0.2}, {c, 0.1}}};
}

TEST(SolidScene, FirstHitIsWhereAMarchEntersTheSolid) {
  Random random;
  for (const auto& planes : someCuts()) {
    const SolidScene scene({cube(4), {notched(planes)}}, kCrease);
    int cutHits = 0, skinHits = 0;
    for (int i = 0; i < 1500; ++i) {
      const Vec3 origin = 5 * random.direction();
      const Ray ray{origin, (random.point(1.2) - origin).normalized()};
      const auto expected = marched(ray, planes);
      const Hit hit = firstHit(scene, ray);
      if (!expected) {
        // The march may step over a sliver.
        if (!hit.scene.none()) {
          EXPECT_FALSE(left(hit.position + 3e-3 * ray.direction, planes));
        }
        continue;
      }
      ASSERT_FALSE(hit.scene.none());
      if (*expected > hit.distance + 2e-3) {  // again a sliver
        EXPECT_FALSE(left(hit.position + 3e-3 * ray.direction, planes));
        continue;
      }
      EXPECT_NEAR(hit.distance, *expected, 2e-3);
      EXPECT_LT((hit.position - ray.origin - hit.distance * ray.direction).norm(), 1e-5);
      EXPECT_LE(hit.normal.dot(ray.direction), 0);
      if (!hit.scene.skin()) {
        ++cutHits;
        EXPECT_NEAR(planes[hit.scene.plane].normal.dot(hit.position), planes[hit.scene.plane].offset, 1e-9);
        EXPECT_LT(hit.position.cwiseAbs().maxCoeff(), 1 + 1e-6);
      } else {
        ++skinHits;
        EXPECT_NEAR(hit.position.cwiseAbs().maxCoeff(), 1, 1e-12);
      }
    }
    EXPECT_GT(skinHits, 300);
    EXPECT_EQ(cutHits > 0, !planes.empty());
  }
}

TEST(SolidScene, OcclusionIsWhatAMarchMeets) {
  Random random;
  for (const auto& planes : someCuts()) {
    const SolidScene scene({cube(4), {notched(planes)}}, kCrease);
    int blocked = 0, decided = 0;
    for (int i = 0; i < 1500; ++i) {
      const Vec3 from = 5 * random.direction();
      const Hit hit = firstHit(scene, {from, (random.point(0.8) - from).normalized()});
      if (hit.scene.none()) continue;
      Vec3 direction = random.direction();
      if (direction.dot(hit.normal) < 0) direction = -direction;
      if (direction.dot(hit.normal) < 0.05) continue;
      const Ray ray{hit.position + 1e-4 * hit.normal, direction};
      const bool expected = marched(ray, planes).has_value();
      const bool found = occluded(scene, ray);
      // What is met for less than a step may be missed by the march, never the other way round.
      EXPECT_TRUE(found || !expected);
      decided += found == expected;
      blocked += found;
    }
    EXPECT_GT(decided, 400);
    // Only a wedge or a corner has walls that see each other.
    EXPECT_EQ(blocked > 20, planes.size() > 1) << blocked;
  }
}

TEST(SolidScene, ShadingNormalsSmoothTheBallAndKeepTheCubesEdges) {
  const SolidScene ball({geodesicSphere(8), {Piece()}}, kCrease), box({cube(6), {Piece()}}, kCrease);
  Random random;
  for (int i = 0; i < 500; ++i) {
    const Vec3 origin = 5 * random.direction();
    const Ray ray{origin, (random.point(0.4) - origin).normalized()};
    const Hit onBall = firstHit(ball, ray), onBox = firstHit(box, ray);
    ASSERT_TRUE(!onBall.scene.none() && onBall.scene.skin());
    EXPECT_GT(onBall.shadingNormal.dot(onBall.position.normalized()), std::cos(0.01));
    // The facet lies below the sphere, by up to 0.003; shadow rays start about as much above it.
    EXPECT_GT(onBall.shadowOrigin.norm(), onBall.position.norm() - 1e-12);
    EXPECT_LT(onBall.shadowOrigin.norm(), 1.006);
    ASSERT_TRUE(!onBox.scene.none() && onBox.scene.skin());
    EXPECT_TRUE(onBox.shadingNormal.isApprox(onBox.normal, 1e-7));
    EXPECT_TRUE(onBox.shadowOrigin.isApprox(onBox.position, 1e-6));
  }
}

TEST(SolidScene, RaysAlongTheSilhouetteMeetNoCutOutsideOfTheSolid) {
  // The plane lies in front of the cube's edges, all over the picture; rays go at the edges themselves.
  const Plane plane{Vec3::UnitX(), 0.2};
  const SolidScene scene({cube(3), {notched({plane})}}, kCrease);
  Random random;
  int met = 0;
  for (int i = 0; i < 20000; ++i) {
    Vec3 onEdge(random.uniform(-1, 1), i & 1 ? 1 : -1, i & 2 ? 1 : -1);
    if (i & 4) std::swap(onEdge[0], onEdge[i & 8 ? 1 : 2]);
    const Vec3 origin = 6 * Vec3(1, random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5)).normalized();
    const Ray ray{origin, (onEdge - origin).normalized()};
    const Hit hit = firstHit(scene, ray);
    if (hit.scene.none() || hit.scene.skin()) continue;
    ++met;
    EXPECT_LT(hit.position.cwiseAbs().maxCoeff(), 1 + 2e-6) << i;
  }
  EXPECT_GT(met, 1000);
}

TEST(SolidScene, CutsHaveNoSpeckles) {
  // Rays at the edges of a body with convex and concave ones, through a plane in front: what all rays around
  // say, the one in the middle has to say too.
  const TriMesh star = starPolyhedron(2);
  const SolidScene scene({star, {notched({{Vec3(1, 0.2, 0.1).normalized(), 0.1}})}}, kCrease);
  Random random;
  int cuts = 0, misses = 0;
  for (int i = 0; i < 30000; ++i) {
    const auto t = static_cast<std::size_t>(random.uniform(0, static_cast<double>(star.triangles.size())));
    const double share = random.uniform(0, 1);
    const Vec3 onEdge = share * star.corner(t, i % 3) + (1 - share) * star.corner(t, (i + 1) % 3);
    const Vec3 origin = 6 * Vec3(1, random.uniform(-1, 1), random.uniform(-1, 1)).normalized();
    const Vec3 direction = (onEdge - origin).normalized();
    const Vec3 side = direction.cross(Vec3::UnitZ()).normalized(), up = direction.cross(side);
    int around = 0, missed = 0;
    for (const Vec3& d : {side, up, Vec3(-side), Vec3(-up)}) {
      const Hit hit = firstHit(scene, {origin, (direction + 3e-5 * d).normalized()});
      around += !hit.scene.none() && !hit.scene.skin();
      missed += hit.scene.none();
    }
    const Hit hit = firstHit(scene, {origin, direction});
    const bool cut = !hit.scene.none() && !hit.scene.skin();
    EXPECT_TRUE(around < 4 || cut) << i;
    EXPECT_TRUE(missed < 4 || !cut) << i;
    cuts += around == 4;
    misses += missed == 4;
  }
  EXPECT_GT(cuts, 1000);
  EXPECT_GT(misses, 100);
}

// A hollow solid has no cut faces: beyond the plane its skin is seen from within, with normals to the viewer.
TEST(SolidScene, AHollowSolidIsSeenFromWithin) {
  const SolidScene scene({geodesicSphere(12), {notched({{Vec3::UnitX(), 0.0}})}, true}, kCrease);
  const Hit hit = firstHit(scene, {{3, 0.3, 0.2}, -Vec3::UnitX()});
  ASSERT_FALSE(hit.scene.none());
  EXPECT_TRUE(hit.scene.skin());
  EXPECT_NEAR(hit.position.norm(), 1, 0.02);
  EXPECT_LT(hit.position[0], 0);
  EXPECT_GT(hit.normal[0], 0.5);
  EXPECT_GT(hit.shadingNormal.dot(-hit.position.normalized()), 0.999);
  // What is beyond the plane throws no shadow, what is left does.
  RayBundle rays;
  rays.add(Vec3f(0.5f, 0, 0), Vec3f(1, 0, 0));
  rays.add(Vec3f(0.5f, 0, 0), Vec3f(-1, 0, 0));
  std::uint8_t blocked[2];
  scene.occluded(rays, false, blocked);
  EXPECT_EQ(blocked[0], 0);
  EXPECT_EQ(blocked[1], 1);
}

TEST(SolidScene, ObjectsStandBeforeBehindAndBesideTheSolid) {
  const auto ballAt = [](double x) {
    return transformed(geodesicSphere(6), [=](const Vec3& v) { return Vec3(0.2 * v + Vec3(x, 0, 0)); });
  };
  const SolidScene scene({geodesicSphere(12), {Piece()}, false, {ballAt(-3), ballAt(2), ballAt(0)}}, kCrease);
  const Hit fromRight = firstHit(scene, {{5, 0, 0}, -Vec3::UnitX()});
  EXPECT_EQ(fromRight.scene.object, 1);
  EXPECT_NEAR(fromRight.position[0], 2.2, 1e-2);
  EXPECT_GT(fromRight.normal[0], 0.9);
  const Hit fromLeft = firstHit(scene, {{-5, 0, 0}, Vec3::UnitX()});
  EXPECT_EQ(fromLeft.scene.object, 0);
  // The third lies within the solid.
  const Hit fromAbove = firstHit(scene, {{0, 0, 5}, -Vec3::UnitZ()});
  EXPECT_EQ(fromAbove.scene.object, -1);
  EXPECT_TRUE(fromAbove.scene.skin());
  RayBundle rays;
  rays.add(Vec3f(1.1f, 0, 0), Vec3f(1, 0, 0));
  rays.add(Vec3f(1.1f, 0, 0), Vec3f(0, 0, 1));
  std::uint8_t blocked[2];
  scene.occluded(rays, false, blocked);
  EXPECT_EQ(blocked[0], 1);
  EXPECT_EQ(blocked[1], 0);
}

// What a piece keeps of a mesh: its area by halves and quarters, closed along shared edges, nothing beyond.
TEST(Clipped, KeepsWhatThePieceHolds) {
  const TriMesh ball = geodesicSphere(10);
  const double whole = surfaceArea(ball);
  const std::vector<Plane> planes{{Vec3::UnitX(), 0.0}, {Vec3::UnitY(), 0.0}};
  const TriMesh left = clipped(ball, notched(planes));
  EXPECT_NEAR(surfaceArea(left), 0.75 * whole, 1e-3 * whole);
  for (const Vec3& v : left.vertices) EXPECT_FALSE(v[0] > 1e-12 && v[1] > 1e-12);
  Piece kept;
  kept.planes = planes;
  const TriMesh quarter = clipped(ball, kept);
  EXPECT_NEAR(surfaceArea(quarter), 0.25 * whole, 1e-3 * whole);
  for (const Vec3& v : quarter.vertices) EXPECT_LE(v.head<2>().maxCoeff(), 1e-12);
  // Triangles that shared an edge still do: the rim is where the planes cut, and nowhere else.
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  for (const Triangle& t : quarter.triangles) {
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(edges.insert({t[k], t[(k + 1) % 3]}).second);
  }
  for (const auto& [a, b] : edges) {
    if (edges.contains({b, a})) continue;
    for (const std::int32_t v : {a, b}) EXPECT_LT(quarter.vertices[v].head<2>().cwiseAbs().minCoeff(), 1e-12);
  }
}

}  // namespace
}  // namespace polestar::detail
