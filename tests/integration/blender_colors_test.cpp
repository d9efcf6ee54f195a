// A solid that `polestar transfer` filled has the same colors in Blender as in `polestar render`.

#include <gtest/gtest.h>

#include <cmath>

#include "integration/kiwi_solid.h"
#include "support/meshes.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;
using namespace test;

// In pixels, wider than the voxels at the skin across which `density` falls.
constexpr int kRamp = 20;

const std::map<std::string, std::string> kGrids{
    {"surface", "FLOAT"}, {"density", "FLOAT"}, {"Cd", "VECTOR_FLOAT"}};

/// Of a solid that fills `Cd`: the same colors in both, and what is wrong is found.
void expectSameCut(const fs::path& mesh, const Vec3& normal) {
  KiwiSolid solid(mesh);
  const std::string kiwi = solid.fill("kiwi");
  const test::Exr ours = solid.cut(kiwi, normal);
  test::BlenderJob job = solid.job(kiwi, kGrids);
  job.cuts.resize(2);
  job.cuts[0] = {.out = "kiwi.exr", .attribute = "Cd", .view = test::CutView::ofPicture(ours)};
  job.cuts[1] = job.cuts[0];
  job.cuts[1].out = "shifted.exr";
  job.cuts[1].voxelsTooFar = 0;
  const test::BlenderOutcome outcome = test::runBlender(job);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.log;

  const test::Exr blenders = test::readExr(job.folder / "kiwi.exr");
  ASSERT_EQ(blenders.color.size(), ours.color.size());
  expectSame(colors(blenders), ours);

  const auto swapped = [&](int x, int y) -> std::optional<Vec3> {
    return blenders.color[blenders.at(x, y)].cast<double>()({1, 0, 2});
  };
  EXPECT_GT(differenceOf(swapped, ours).mean, kOther);
  const test::Exr shifted = test::readExr(job.folder / "shifted.exr");
  EXPECT_GT(differenceOf(colors(shifted), ours).mean, kOther);
  const std::string turned = solid.fill("turned", {"--rotate", "0,0,30"});
  EXPECT_GT(differenceOf(colors(blenders), solid.cut(turned, normal)).mean, kOther);
}

TEST(BlenderColors, OfCastaliaAreOurs) {
  POLESTAR_REQUIRE_BLENDER();
  POLESTAR_REQUIRE_MESHES();
  expectSameCut(*testing::meshFolder() / "castalia.obj", Vec3::UnitZ());
}

TEST(BlenderColors, OfASlantingCutAreOurs) {
  POLESTAR_REQUIRE_BLENDER();
  expectSameCut(fs::path(POLESTAR_VOLUMES_FOLDER) / "smooth_star.ply", Vec3(0.5, -0.4, 1));
}

// What an artist gets without nodes of his own: a fog of `density`, in the colors of `color`.
TEST(BlenderColors, OfAPrincipledVolumeAreOurs) {
  POLESTAR_REQUIRE_BLENDER();
  KiwiSolid solid(fs::path(POLESTAR_VOLUMES_FOLDER) / "smooth_star.ply");
  const std::string kiwi = solid.fill("kiwi", {"--dcc", "blender"});
  const test::Exr ours = solid.cut(kiwi, Vec3::UnitX());
  test::BlenderJob job =
      solid.job(kiwi, {{"surface", "FLOAT"}, {"density", "FLOAT"}, {"color", "VECTOR_FLOAT"}});
  const test::BlenderCut emission{
      .out = "emission.exr", .attribute = "color", .view = test::CutView::ofPicture(ours)};
  test::BlenderCut fog = emission;
  fog.out = "fog.exr";
  fog.shader = test::BlenderCut::Shader::principled;
  job.cuts = {emission, fog};
  const test::BlenderOutcome outcome = test::runBlender(job);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.log;
  expectSame(colors(test::readExr(job.folder / "emission.exr")), ours);
  const test::Exr fogs = test::readExr(job.folder / "fog.exr");
  expectSame(straightColors(fogs), ours);

  // The fog is as dense as `density` says: 1 inside, nothing beside the solid.
  double opacity = 0;
  int deep = 0;
  for (int y = 0; y < ours.height; ++y) {
    for (int x = 0; x < ours.width; ++x) {
      const float alpha = fogs.alpha[fogs.at(x, y)];
      if (isDeep(ours, x, y, kRamp)) {
        opacity += static_cast<double>(alpha);
        ++deep;
      } else if (x == 0 || y == 0) {
        EXPECT_EQ(alpha, 0);
      }
    }
  }
  ASSERT_GT(deep, 3000);
  EXPECT_NEAR(opacity / deep, 1 - std::exp(-test::kFogOpticalDepth), 0.005);
}

}  // namespace
}  // namespace polestar
