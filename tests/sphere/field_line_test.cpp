#include <gtest/gtest.h>

#include <string>

#include "polestar/core/error.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/conformal.h"
#include "polestar/sphere/sphere_map.h"
#include "support.h"

namespace polestar {
namespace {

using detail::fieldLineMap;

TEST(FieldLineMap, IsOmegaItself) {
  const TriMesh mesh = smoothStar(3);
  const std::vector<Vec3> omega = testing::rotated(testing::someRotation(), icosphere(3).vertices);
  const SphereMap map = fieldLineMap(mesh, omega, Context::quiet());
  EXPECT_EQ(map.kind, SphereMapKind::fieldLine);
  EXPECT_TRUE(map.directions == omega);
  EXPECT_EQ(map.flips, 0u);
  EXPECT_EQ(map.repairedVertices, 0u);
  EXPECT_EQ(map.fallbackReason, "");
}

TEST(FieldLineMap, TurnsFlipsBack) {
  const TriMesh mesh = smoothStar(4);
  std::vector<Vec3> omega = icosphere(4).vertices;
  const Triangle& t = mesh.triangles[321];
  omega[t[0]] = (omega[t[0]] + 2.5 * (omega[t[1]] - omega[t[0]])).normalized();
  ASSERT_GT(countFlips(omega, mesh.triangles), 0u);
  const SphereMap map = fieldLineMap(mesh, omega, Context::quiet());
  EXPECT_EQ(map.kind, SphereMapKind::fieldLine);
  EXPECT_EQ(countFlips(map.directions, mesh.triangles), 0u);
  EXPECT_GT(map.repairedVertices, 0u);
  std::size_t moved = 0;
  for (std::size_t i = 0; i < omega.size(); ++i) moved += map.directions[i] != omega[i];
  EXPECT_LE(moved, map.repairedVertices);
  EXPECT_LT(map.repairedVertices, 200u);
}

TEST(FieldLineMap, FallsBackLoudly) {
  const TriMesh mesh = smoothStar(2);
  std::vector<Vec3> mirrored = mesh.vertices;
  for (Vec3& v : mirrored) v = Vec3(v[0], v[1], -v[2]).normalized();
  Context context;
  std::string warning;
  context.onLog = [&](LogLevel level, std::string_view message) {
    if (level == LogLevel::warning) warning = message;
  };
  const SphereMap map = fieldLineMap(mesh, mirrored, context);
  EXPECT_EQ(map.kind, SphereMapKind::conformal);
  EXPECT_EQ(map.flips, 0u);
  EXPECT_NE(map.fallbackReason.find("field lines"), std::string::npos);
  EXPECT_EQ(warning, map.fallbackReason);
}

}  // namespace
}  // namespace polestar
