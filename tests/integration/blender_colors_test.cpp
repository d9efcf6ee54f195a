// A solid that `polestar transfer` filled has the same colors in Blender as in `polestar render`.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "cli/run_tool.h"
#include "integration/blender.h"
#include "integration/difference.h"
#include "support/meshes.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;
using testing::ScratchFolder;
using testing::ToolRun;

// Of scene-linear colors in [0, 1], absolute, over the pixels of a cut and their channels. Found are 0.0004
// to 0.0008: Blender shows a slab of a fifth of a voxel, ours is a plane, and Cycles reads colors as half
// floats. One step of 8 bits of sRGB is 0.004 in the middle greys, so to the eye both are the same.
constexpr double kSame = 0.002;
// Of a single channel: at the edges of seeds.
constexpr double kSameWorst = 0.03;
// What is wrong has to differ by much more; found are 0.011 and above.
constexpr double kOther = 3 * kSame;
// Pixels this near to another surface are not compared: the filters of the renderers blend them differently.
constexpr int kRim = 2;
// In pixels, wider than the voxels at the skin across which `density` falls.
constexpr int kRamp = 20;

const std::map<std::string, std::string> kGrids{
    {"surface", "FLOAT"}, {"density", "FLOAT"}, {"Cd", "VECTOR_FLOAT"}};

void tool(const std::vector<std::string>& arguments) {
  const ToolRun run = testing::runTool(arguments);
  ASSERT_EQ(run.exitCode, 0) << run.err;
}

/// A mesh, mapped and filled with kiwi in several ways; names in the folder.
class KiwiSolid {
 public:
  explicit KiwiSolid(const fs::path& mesh) {
    tool({"map", mesh.string(), "-o", folder_ / "body.vdb", "--dim", "48", "--tolerance", "5e-3"});
  }

  std::string fill(const std::string& name, const std::vector<std::string>& options = {}) {
    const std::string vdb = folder_ / (name + ".vdb");
    std::vector<std::string> arguments{"transfer", "kiwi", folder_ / "body.vdb", "-o", vdb, "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ToolRun run = testing::runTool(arguments);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    voxelSize_ = run.json()["voxel_size"].get<double>();
    return vdb;
  }

  /// Our picture of a cut, seen at right angles.
  test::Exr cut(const std::string& vdb, const Vec3& normal) const {
    std::array<std::string, 2> directions;
    for (int k = 0; k < 3; ++k) {
      directions[0] += (k ? "," : "") + std::to_string(normal[k]);
      directions[1] += (k ? "," : "") + std::to_string(-normal[k]);
    }
    const std::string exr = folder_ / "ours.exr";
    tool({"render", vdb, "-o", exr, "--overwrite", "--flat", "--cut", directions[0], "--view", directions[1],
          "--up", "0,1,0", "--fov", "2", "--size", "240x200", "--samples", "32"});
    return test::readExr(exr);
  }

  test::BlenderJob job(const std::string& vdb, const std::map<std::string, std::string>& grids) const {
    return {folder_.path(), vdb, voxelSize_, grids, {}};
  }

 private:
  ScratchFolder folder_;
  double voxelSize_ = 0;
};

/// Does a pixel show the cut, and all others up to `rim` away in x and y, too?
bool isDeep(const test::Exr& ours, int x, int y, int rim) {
  if (x < rim || y < rim || x >= ours.width - rim || y >= ours.height - rim) return false;
  for (int dy = -rim; dy <= rim; ++dy) {
    for (int dx = -rim; dx <= rim; ++dx) {
      if (ours.id[ours.at(x + dx, y + dy)] != test::kFirstCut) return false;
    }
  }
  return true;
}

test::PixelColor colors(test::Exr picture) {
  return [p = std::move(picture)](int x, int y) { return p.color[p.at(x, y)].cast<double>(); };
}

/// What a fog scatters, whatever its density.
test::PixelColor straightColors(test::Exr picture) {
  return [p = std::move(picture)](int x, int y) -> std::optional<Vec3> {
    const std::size_t pixel = p.at(x, y);
    if (!(p.alpha[pixel] > 0)) return std::nullopt;
    return p.color[pixel].cast<double>() / static_cast<double>(p.alpha[pixel]);
  };
}

/// On the cut of our picture.
test::Difference differenceOf(const test::PixelColor& found, const test::Exr& ours) {
  const auto expected = [&](int x, int y) -> std::optional<Vec3> {
    if (!isDeep(ours, x, y, kRim)) return std::nullopt;
    return ours.color[ours.at(x, y)].cast<double>();
  };
  return test::difference(ours.width, ours.height, found, expected);
}

void expectSame(const test::PixelColor& found, const test::Exr& ours) {
  const test::Difference difference = differenceOf(found, ours);
  EXPECT_GT(difference.pixels, 5000U);
  EXPECT_LT(difference.mean, kSame);
  EXPECT_LT(difference.worst, kSameWorst);
}

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
