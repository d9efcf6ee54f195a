// The frames of a morph as one sequence in Debian's Blender, headless: each shows the solid of its own time.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "integration/kiwi_solid.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar::test {
namespace {

namespace fs = std::filesystem;
using testing::runTool;
using testing::ScratchFolder;
using testing::ToolRun;

constexpr int kFrames = 3;
constexpr double kWindow = 6;  // of the pictures, mesh units

/// A ball of radius 1 at the origin that grows to radius 1.5 while its center moves to (0, 2, 0): at all
/// times a ball.
struct GrowingBall {
  static double radius(int frame) { return 1 + 0.5 * (frame - 1) / (kFrames - 1); }
  static Vec3 center(int frame) { return {0, 2.0 * (frame - 1) / (kFrames - 1), 0}; }

  ScratchFolder folder;
  double voxelSize = 0;

  GrowingBall() {
    const TriMesh unit = icosphere(3), large = transformed(unit, [](const Vec3&x) -> Vec3 {
                                         return radius(kFrames) * x + center(kFrames);
                                       });
    const ToolRun run = runTool({"morph", folder.obj("small.obj", unit), folder.obj("large.obj", large),
                                 "--frames", "1-" + std::to_string(kFrames), "--dim", "40", "--texture",
                                 "kiwi", "-o", folder / "grow_####.vdb", "--json"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    if (run.exitCode == 0) voxelSize = run.json()["voxel_size"];
  }

  std::string file(int frame) const { return folder / ("grow_000" + std::to_string(frame) + ".vdb"); }

  /// A picture of the plane x = 0 for each frame.
  BlenderJob job() const {
    BlenderJob job;
    job.folder = folder.path();
    job.vdb = file(1);
    job.sequence = true;
    job.voxelSize = voxelSize;
    job.grids = {{"surface", "FLOAT"},
                 {"density", "FLOAT"},
                 {"rest", "VECTOR_FLOAT"},
                 {"vel", "VECTOR_FLOAT"},
                 {"Cd", "VECTOR_FLOAT"}};
    for (int frame = 1; frame <= kFrames; ++frame) {
      BlenderCut cut;
      cut.out = "frame" + std::to_string(frame) + ".exr";
      cut.frame = frame;
      cut.attribute = "Cd";
      cut.shader = BlenderCut::Shader::principled;
      cut.view = CutView::ofAxis(0, Vec3(0, 1.25, 0), kWindow, 120);
      job.cuts.push_back(cut);
    }
    return job;
  }
};

/// The box that Blender has around a file's grids: of whole leaves, from the middle of the first voxel to
/// that of the last. (Pictures have volumes half a voxel too far, the box is in its place.)
Box leavesOf(const fs::path& file) {
  constexpr int kLeaf = 8;
  Box all;
  for (const GridInfo& grid : readGridInfo(file)) {
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      const int first = grid.indexMin[axis] & ~(kLeaf - 1), last = grid.indexMax[axis] | (kLeaf - 1);
      // GridInfo's box has the whole of the outermost voxels.
      const double before = first - grid.indexMin[axis] + 0.5, behind = last - grid.indexMax[axis] - 0.5;
      all.min[k] = std::min(all.min[k], grid.box.min[k] + before * grid.voxelSize);
      all.max[k] = std::max(all.max[k], grid.box.max[k] + behind * grid.voxelSize);
    }
  }
  return all;
}

struct Disk {
  double area = 0;
  Vec3 middle = Vec3::Zero();
};

/// Of the pixels that show a density above a half, as it is inside of the surface; in the middle of the slab
/// it is 1.
Disk coveredBy(const Exr& picture, const CutView& view) {
  const double half = (1 - std::exp(-kFogOpticalDepth / 2)) / (1 - std::exp(-kFogOpticalDepth));
  const float limit =
      static_cast<float>(half) * *std::max_element(picture.alpha.begin(), picture.alpha.end());
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
  const GrowingBall ball;
  const BlenderJob job = ball.job();
  const BlenderOutcome outcome = runBlender(job);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.log;
  ASSERT_EQ(outcome.bounds.size(), static_cast<std::size_t>(kFrames));
  std::vector<Exr> pictures;
  for (int frame = 1; frame <= kFrames; ++frame) {
    SCOPED_TRACE("frame " + std::to_string(frame));
    const BlenderCut& cut = job.cuts[static_cast<std::size_t>(frame - 1)];
    const Box shown = outcome.bounds[static_cast<std::size_t>(frame - 1)], ours = leavesOf(ball.file(frame));
    EXPECT_LT((shown.min - ours.min).norm() + (shown.max - ours.max).norm(), 1e-3 * ball.voxelSize);
    // No other frame's.
    for (int other = 1; other <= kFrames; ++other) {
      if (other == frame) continue;
      const Box theirs = leavesOf(ball.file(other));
      EXPECT_GT((shown.min - theirs.min).norm() + (shown.max - theirs.max).norm(), ball.voxelSize);
    }
    pictures.push_back(readExr(job.folder / cut.out));
    ASSERT_FALSE(pictures.back().alpha.empty());
    const Disk disk = coveredBy(pictures.back(), cut.view);
    const double radius = GrowingBall::radius(frame);
    // The icosphere's triangles are flat, and pixels square.
    EXPECT_NEAR(disk.area, std::numbers::pi * radius * radius, 0.04 * disk.area);
    EXPECT_LT((disk.middle - GrowingBall::center(frame)).norm(), 0.5 * ball.voxelSize);
  }
  // What is seen of both, has other colors: the kiwi moves along.
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const Difference difference = test::difference(
          pictures[i].width, pictures[i].height, straightColors(pictures[i]), straightColors(pictures[k]));
      EXPECT_GT(difference.pixels, 200U);
      EXPECT_GT(difference.mean, 0.02) << i << ' ' << k;
    }
  }
}

TEST(BlenderMorph, AMissingFrameIsFound) {
  POLESTAR_REQUIRE_BLENDER();
  const GrowingBall ball;
  BlenderJob job = ball.job();
  // Nothing but the middle frame is asked for, and that is gone.
  job.cuts = {job.cuts[1]};
  ASSERT_TRUE(fs::remove(ball.file(2)));
  const BlenderOutcome outcome = runBlender(job);
  EXPECT_EQ(outcome.exitCode, 3);
  EXPECT_NE(outcome.log.find("frame 2 shows"), std::string::npos) << outcome.log;
}

}  // namespace
}  // namespace polestar::test
