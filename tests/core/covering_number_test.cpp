// Covering numbers of surfaces whose answer is known, wherever the direction that is counted in falls on
// them.

#include "polestar/core/covering_number.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

int coveringNumberOf(const TriMesh& mesh) { return coveringNumber(mesh.vertices, mesh.triangles); }

TEST(CoveringNumber, OneMinusOneTwoZero) {
  const TriMesh mesh = icosphere(4);
  EXPECT_EQ(coveringNumberOf(mesh), 1);
  const auto moved = [&](const std::function<Vec3(const Vec3&)>& move) {
    return coveringNumberOf(transformed(mesh, move));
  };
  EXPECT_EQ(moved([](const Vec3& v) { return Vec3(-v[0], v[1], v[2]); }), -1);
  // z -> z^2 in the plane of the longitudes wraps the sphere twice.
  EXPECT_EQ(moved([](const Vec3& v) {
              const double angle = 2 * std::atan2(v[1], v[0]), r = std::hypot(v[0], v[1]);
              return Vec3(r * std::cos(angle), r * std::sin(angle), v[2]);
            }),
            2);
  EXPECT_EQ(moved([](const Vec3& v) { return Vec3(v[0], v[1], 3).normalized(); }), 0);
}

TEST(CoveringNumber, AVertexOrAnEdgeInTheDirectionThatIsCountedIsNoMatter) {
  // Of the octahedron a vertex lies at +x; turned about z by an eighth, the middle of an edge.
  TriMesh mesh;
  mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  EXPECT_EQ(coveringNumberOf(mesh), 1);
  EXPECT_EQ(
      coveringNumberOf(transformed(mesh, [](const Vec3& v) { return Vec3(v[0] - v[1], v[0] + v[1], v[2]); })),
      1);
  // All turns by right angles, and triangles that have a side through x, -x or no area.
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 1, 1).normalized()}) {
    for (int k = 1; k < 4; ++k) {
      const Mat3 turn = Eigen::AngleAxisd(k * std::numbers::pi / 2, axis).toRotationMatrix();
      EXPECT_EQ(coveringNumberOf(transformed(cube(2), [&](const Vec3& v) { return Vec3(turn * v); })), 1);
    }
  }
  mesh.triangles.push_back({0, 1, 2});
  mesh.triangles.push_back({0, 0, 2});
  EXPECT_EQ(coveringNumberOf(mesh), 1);
}

TEST(CoveringNumber, IsExactForTheSmallestAndTheLargestNumbers) {
  for (const double scale : {1e-320, 1e-300, 1e-160, 1e-60, 1e60, 1e160, 1e300}) {
    const auto scaled = [&](const TriMesh& mesh, double z) {
      return coveringNumberOf(
          transformed(mesh, [&](const Vec3& v) { return Vec3(scale * v + Vec3(0, 0, z)); }));
    };
    EXPECT_EQ(scaled(icosphere(1), 0), 1) << scale;
    // The bottom one unit in the last place below the origin, then above it.
    EXPECT_EQ(scaled(cube(3), std::nextafter(scale, 0.0)), 1) << scale;
    EXPECT_EQ(scaled(cube(3), std::nextafter(scale, 2 * scale)), 0) << scale;
  }
}

TEST(CoveringNumber, CountsWhatLiesWithinNoise) {
  // Vertices far off their places fold the surface over and over; its winding number about a point inside
  // all of that stays 1.
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<> uniform(-0.5, 0.5);
  for (int trial = 0; trial < 50; ++trial) {
    EXPECT_EQ(coveringNumberOf(transformed(icosphere(3),
                                           [&](const Vec3& v) {
                                             return Vec3(v + 0.8 * Vec3(uniform(engine), uniform(engine),
                                                                        uniform(engine)));
                                           })),
              1);
  }
}

}  // namespace
}  // namespace polestar
