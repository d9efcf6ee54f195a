// What the library maps holds, and what spoils it in a natural shape is seen there, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

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

SolidGrids gridsOfSize(const BallMap& map, int dim) {
  const TriMesh& mesh = map.chart().green().shape().surface().mesh();
  return gridsOf(map, {.voxelSize = voxelSizeFor(mesh, dim)}, Context::quiet());
}

verify::VoxelSolid voxels(const SolidGrids& grids) {
  const test::ScratchFolder folder;
  grids.write(folder / "map.vdb");
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
  // Coarse enough for the cube's corners.
  EXPECT_EQ(certifyGrids(map, gridsOfSize(map, 32), 5000).verdict, Verdict::proved);
  expectHolds(judgePmap(contentsOf(map)));
  expectHolds(judgeVdb(voxels(gridsOfSize(map, 48))));
}

class RealMeshes : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Files, RealMeshes,
                         ::testing::ValuesIn(chosenModels({"psyche.obj", "KW4Alpha.obj", "churyumov.obj"},
                                                          {"itokawa_16.obj", "yorp.stl", "sylvia.off",
                                                           "castalia_far.obj", "castalia_tiny.ply"})),
                         [](const auto& file) { return file.param.substr(0, file.param.find('.')); });

TEST_P(RealMeshes, WhatIsProvedHolds) {
  POLESTAR_REQUIRE_MESHES();
  const BallMap map = ballMap(starShapeFromFile(*meshFolder() / GetParam()));
  EXPECT_EQ(certifyGrids(map, gridsOfSize(map, 32), 5000).verdict, Verdict::proved);
  expectHolds(judgePmap(contentsOf(map)));
}

// The library's own checks and the judge's are to agree on what is wrong, too.
TEST(WrongMaps, WhatTheJudgeRefusesIsNotProved) {
  const BallMap& good = smallMap();
  const Foliation& f = good.chart().foliation();
  const struct {
    const char *ours, *theirs;
    std::function<void(std::vector<Vec3>&)> spoil;
  } cases[] = {{"image_cells", "cells_ball",
                [&](auto& ball) { std::swap(ball[f.nodeId(4, 9)], ball[f.nodeId(7, 9)]); }},
               {"image_radii", "ball_boundary", [&](auto& ball) { ball[3] *= 1 - 1e-11; }},
               {"image_radii", "ball_levels", [&](auto& ball) { ball[f.nodeId(2, 5)] *= 1 + 2e-12; }},
               {"sphere_degree", "ball_degree",
                [&](auto& ball) {
                  for (auto& y : ball) y[1] = -y[1];
                }},
               {"center", "center", [&](auto& ball) { ball.back()[2] = 1e-100; }},
               {"finite", "finite", [&](auto& ball) { ball[f.nodeId(6, 2)][0] = NAN; }}};
  for (const auto& [ours, theirs, spoil] : cases) {
    NodeImages images = good.nodeImages();
    spoil(images.ball);
    const BallMap map(good.chart(), good.sphere(), good.options(), good.radius(), std::move(images));
    const auto has = [](const auto& checks, const std::string& name) {
      return std::any_of(checks.begin(), checks.end(),
                         [&](const auto& check) { return check.name == name && !check.passed; });
    };
    const Certificate certificate = certify(map, {}, {}, 1);
    EXPECT_EQ(certificate.verdict, Verdict::failed);
    EXPECT_TRUE(has(certificate.checks, ours)) << ours;
    EXPECT_TRUE(has(judgePmap(contentsOf(map)).checks, theirs)) << theirs;
  }
}

TEST(RealMesh, HoldsAndItsSpoiledCopiesDoNot) {
  POLESTAR_REQUIRE_MESHES();
  const BallMap map = ballMap(starShapeFromFile(*meshFolder() / "castalia.obj"));
  expectHolds(judgePmap(contentsOf(map)));
  const verify::VoxelSolid good = voxels(gridsOfSize(map, 64));
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
