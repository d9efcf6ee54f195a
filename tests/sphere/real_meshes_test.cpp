#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cstdio>
#include <optional>

#include "polestar/core/covering_number.h"
#include "polestar/core/error.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/repair.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/laplacian.h"
#include "polestar/sphere/detail/sphere_quality.h"
#include "polestar/sphere/sphere_map.h"
#include "support.h"
#include "support/meshes.h"

namespace polestar {
namespace {

TriMesh cleaned(const std::filesystem::path& path) { return repairMesh(readMesh(path).mesh).mesh; }

StarShape starShape(TriMesh mesh) {
  StarOptions options;
  options.rays = 0;
  return verifyStarShape(verifyClosedSurface(std::move(mesh)), options);
}

TEST(RealMeshes, NeverShipAFlip) {
  POLESTAR_REQUIRE_MESHES();
  std::printf("%-24s %7s %8s %8s %8s %6s %8s  %s\n", "model", "V", "seconds", "qc mean", "qc max", "flips",
              "repaired", "fallback");
  for (const auto& entry : testing::manifest()) {
    if (entry.star != "yes") continue;
    const std::string name = entry.path.filename().string();
    SCOPED_TRACE(name);
    std::optional<StarShape> shape;
    ASSERT_NO_THROW(shape = starShape(cleaned(entry.path)));
    const TriMesh& mesh = shape->mesh();
    const auto start = std::chrono::steady_clock::now();
    const SphereMap map = conformalSphereMap(*shape);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%-24s %7zu %8.3f %8.4f %8.3g %6zu %8zu  %s\n", name.c_str(), mesh.vertices.size(), seconds,
                map.qcMean, map.qcMax, map.flips, map.repairedVertices, map.fallbackReason.c_str());

    EXPECT_EQ(map.flips, 0u);
    EXPECT_EQ(countFlips(map.directions, mesh.triangles), 0u);
    EXPECT_EQ(coveringNumber(map.directions, mesh.triangles), 1);
    EXPECT_EQ(map.kind, SphereMapKind::conformal);
    EXPECT_EQ(map.fallbackReason, "");
    EXPECT_LE(map.qcMean, radialSphereMap(*shape).qcMean * (1 + 1e-9));
    if (mesh.vertices.size() > 5000) {
      EXPECT_LE(map.qcMean, 1.05);
    }
    const std::vector<double> shares = detail::vertexAreaShares(mesh);
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = 0; i < shares.size(); ++i) mean += shares[i] * map.directions[i];
    EXPECT_LT(mean.norm(), 1e-10);
  }
}

TEST(RealMeshes, TurningMovingAndScalingOnlyTurnsTheDirections) {
  POLESTAR_REQUIRE_MESHES();
  for (const char* name : {"castalia.obj", "castalia_bump_2.obj", "fandisk.off"}) {
    const TriMesh mesh = cleaned(*testing::meshFolder() / name);
    const TriMesh moved = transformed(
        mesh, [](const Vec3& v) { return Vec3(37.0 * (testing::someRotation() * v) + Vec3(12, -5, 300)); });
    const SphereMap a = conformalSphereMap(starShape(mesh)), b = conformalSphereMap(starShape(moved));
    EXPECT_LT(
        testing::largestDifference(testing::rotated(testing::someRotation(), a.directions), b.directions),
        1e-6)
        << name;
  }
}

TEST(RealMeshes, FarAndTinyCopiesGiveTheSameMap) {
  POLESTAR_REQUIRE_MESHES();
  const auto folder = *testing::meshFolder();
  const StarShape original = starShape(cleaned(folder / "castalia.obj"));
  const SphereMap reference = conformalSphereMap(original);
  for (const char* name : {"castalia_far.obj", "castalia_tiny.ply"}) {
    const StarShape shape = starShape(cleaned(folder / name));
    const SphereMap copy = conformalSphereMap(shape);
    ASSERT_EQ(copy.directions.size(), reference.directions.size());
    double most = 0, apart = 0;
    for (std::size_t i = 0; i < copy.directions.size();
         ++i) {  // the files list the vertices in another order
      std::size_t same = 0;
      auto distance = [&](std::size_t j) {
        return (original.mesh().vertices[j] - shape.mesh().vertices[i]).norm();
      };
      for (std::size_t j = 1; j < reference.directions.size(); ++j) {
        if (distance(j) < distance(same)) same = j;
      }
      apart = std::max(apart, distance(same));
      most = std::max(most, (reference.directions[same] - copy.directions[i]).norm());
    }
    ASSERT_LT(apart, 1e-6) << name;
    EXPECT_LT(most, 1e-6) << name << ": vertices differ by " << apart;
  }
}

}  // namespace
}  // namespace polestar
