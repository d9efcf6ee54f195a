// What the library maps holds, and what spoils it in a natural shape is seen there, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pmap_maps.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/pipeline.h"
#include "support/meshes.h"
#include "support/scratch_folder.h"
#include "support/solids.h"
#include "verify/judge_pmap.h"
#include "verify/judge_vdb.h"
#include "verify/vdb_file.h"

namespace polestar::testing {
namespace {

verify::VoxelSolid voxels(const BallMap& map, int dim) {
  const test::ScratchFolder folder;
  const TriMesh& mesh = map.chart().green().shape().surface().mesh();
  gridsOf(map, {.voxelSize = voxelSizeFor(mesh, dim)}, Context::quiet()).write(folder / "map.vdb");
  return verify::readVdb(folder / "map.vdb");
}

void expectHolds(const verify::Report& report) { EXPECT_TRUE(report.holds()) << toText(report); }

class ShippedVolumes : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Files, ShippedVolumes,
                         ::testing::Values("ball_offcenter.ply", "smooth_star.ply", "half_ball.ply",
                                           "cube.obj", "twelve_lobes.ply"),
                         [](const auto& file) {
                           const std::string name = file.param;
                           return name.substr(0, name.find('.'));
                         });

TEST_P(ShippedVolumes, MapsHold) {
  const std::filesystem::path path = std::filesystem::path(POLESTAR_VOLUMES_FOLDER) / GetParam();
  const BallMap map = ballMap(starShapeFromFile(path));
  expectHolds(judgePmap(contentsOf(map)));
  expectHolds(judgeVdb(voxels(map, 48)));
}

TEST(RealMesh, HoldsAndItsSpoiledCopiesDoNot) {
  POLESTAR_REQUIRE_MESHES();
  const BallMap map = ballMap(starShapeFromFile(*meshFolder() / "castalia.obj"));
  expectHolds(judgePmap(contentsOf(map)));
  const verify::VoxelSolid good = voxels(map, 64);
  expectHolds(judgeVdb(good));

  const auto reason = [](const verify::VoxelSolid& solid) {
    const verify::Report report = judgeVdb(solid);
    return report.holds() ? std::string() : report.firstFailure()->name;
  };
  verify::VoxelSolid spoiled = good;
  for (std::size_t v = 0; v < spoiled.count(); ++v) {
    const verify::Vec3 d = spoiled.position(v) - spoiled.center;
    const double scale = length(toDouble(spoiled.rest[v])) / length(d);
    spoiled.rest[v] = {static_cast<float>(scale * d.x), static_cast<float>(scale * d.y),
                       static_cast<float>(scale * d.z)};
  }
  EXPECT_EQ(reason(spoiled), "field_lines") << "straight rays";
  spoiled = good;
  for (auto& rest : spoiled.rest) rest.x = -rest.x;
  EXPECT_EQ(reason(spoiled), "degree") << "mirrored";
  spoiled = good;
  spoiled.center.y += 2;
  EXPECT_EQ(reason(spoiled), "pole") << "wrong pole";
  spoiled = good;
  for (std::size_t v = 0; v < spoiled.count(); ++v) {
    // A source spread over the solid, and the radius that goes with it.
    const double rho = spoiled.harmonicRadius, r = length(spoiled.position(v) - spoiled.center) / rho;
    const double rhoG = rho * spoiled.green[v] * (1 + 0.3 * r * r * r);
    spoiled.green[v] = static_cast<float>(std::min(rhoG / rho, spoiled.greenCap));
    const double scale = 1 / (1 + rhoG) / length(toDouble(spoiled.rest[v]));
    auto& rest = spoiled.rest[v];
    rest = {static_cast<float>(scale * rest.x), static_cast<float>(scale * rest.y),
            static_cast<float>(scale * rest.z)};
  }
  EXPECT_EQ(reason(spoiled), "harmonic") << "not harmonic";
}

}  // namespace
}  // namespace polestar::testing
