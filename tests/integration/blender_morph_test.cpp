// A morph's frames as a sequence in Debian's Blender, headless: each frame shows the solid of its own time.

#include <gtest/gtest.h>

#include <numbers>

#include "cli/run_tool.h"
#include "integration/blender.h"
#include "polestar/mesh/shapes.h"

namespace polestar::test {
namespace {

using testing::runTool;
using testing::ScratchFolder;
using testing::ToolRun;

struct Disk {
  double area = 0;
  Vec3 middle = Vec3::Zero();
};

/// Of the pixels that are more than half as opaque as the most opaque one.
Disk coveredBy(const Exr& picture, const CutView& view) {
  const float limit = *std::max_element(picture.alpha.begin(), picture.alpha.end()) / 2;
  const double pixel = (view.pointAt(1, 0) - view.pointAt(0, 0)).norm();
  Disk disk;
  int count = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (!(picture.alpha[picture.at(x, y)] > limit)) continue;
      disk.middle += view.pointAt(x, y);
      ++count;
    }
  }
  disk.area = count * pixel * pixel;
  disk.middle /= std::max(count, 1);
  return disk;
}

TEST(BlenderMorph, EachFrameOfTheSequenceIsInItsPlace) {
  POLESTAR_REQUIRE_BLENDER();
  const ScratchFolder folder;
  // A ball that grows from radius 1 to 1.5 while its center moves by 2.
  const std::string small = folder.obj("small.obj", icosphere(3)),
                    large = folder.obj("large.obj", transformed(icosphere(3), [](const Vec3&x) {
                                         return Vec3(1.5 * x + Vec3(0, 2, 0));
                                       }));
  const ToolRun run = runTool({"morph", small, large, "--frames", "1-3", "--dim", "60", "--texture", "kiwi",
                               "-o", folder / "grow_####.vdb", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  BlenderJob job;
  job.folder = folder.path();
  job.vdb = folder / "grow_0001.vdb";
  job.voxelSize = run.json()["voxel_size"];
  job.grids = {{"density", "FLOAT"}, {"Cd", "VECTOR_FLOAT"}, {"vel", "VECTOR_FLOAT"}};
  job.addon = packAddon(folder.path());
  BlenderCut cut;
  cut.view = CutView::ofAxis(0, Vec3(0, 1.25, 0), 6, 160);
  cut.shader = BlenderCut::Shader::imported;
  for (int frame = 1; frame <= 3; ++frame) {
    cut.out = "frame" + std::to_string(frame) + ".exr";
    job.cuts = {cut};
    job.frame = frame;
    const BlenderOutcome outcome = runBlender(job);
    ASSERT_EQ(outcome.exitCode, 0) << outcome.log;
    const Disk disk = coveredBy(readExr(folder.path() / cut.out), cut.view);
    const double radius = 1 + 0.25 * (frame - 1);
    EXPECT_NEAR(disk.area, std::numbers::pi * radius * radius, 0.04 * disk.area) << "frame " << frame;
    EXPECT_LT((disk.middle - Vec3(0, frame - 1, 0)).norm(), 0.05) << "frame " << frame;
  }
}

}  // namespace
}  // namespace polestar::test
