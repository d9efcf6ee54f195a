// Stacks of slices out, and back in again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>

#include "polestar/core/error.h"
#include "polestar/io/slice_stack.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/grid_set.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;

Vec3f light(const Vec3& x) {
  return {static_cast<float>(0.5 + 0.3 * x.x()), static_cast<float>(0.5 - 0.2 * x.y()),
          static_cast<float>(0.4 + 0.3 * x.z())};
}

class WriteSlices : public ::testing::Test {
 protected:
  /// A colored ball: `surface`, `density`, `Cd` with its padding.
  SampledGrids colored() const {
    SolidGrids grids(icosphere(3), {.voxelSize = 0.125});
    grids.addVector("Cd", ValueRole::invariant, [](const VoxelBatch& batch, std::span<Vec3f> values) {
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = light(batch.points[i]);
    });
    return grids.lookUp();
  }
  static Vec3f at(const SampledGrids& grids, const std::string& name, bool vector, const Vec3& x) {
    Vec3f value = Vec3f::Constant(-1);
    float weight = 0;
    if (const SampledGrid* grid = grids.find(name, vector))
      grid->sample({&x, 1}, {}, {&value, 1}, {&weight, 1});
    return weight > 0.5f ? value : Vec3f(Vec3f::Zero());
  }
  std::string pattern(const std::string& name) const { return folder_ / name; }

  test::ScratchFolder folder_;
};

TEST_F(WriteSlices, ComeBackAsTheyWere) {
  const SampledGrids grids = colored();
  const SliceLayout stack = planSlices(grids);
  EXPECT_EQ(stack.grid, "Cd");
  EXPECT_TRUE(stack.alpha);
  for (const char* name : {"s.###.png", "s.###.tif", "s.###.exr"}) {
    EXPECT_EQ(writeSlices(FramePath(pattern(name)), grids, stack), 0U);
    const SampledGrids back = readSlices(pattern(name), stack.place);
    const double tolerance = std::string(name).ends_with("png") ? 1e-4 : 1e-6;
    for (const Vec3& x : {Vec3(0.31, 0.2, 0.1), Vec3(-0.5, 0.4, 0.3), Vec3(0, -0.7, 0.44)}) {
      EXPECT_LT((at(back, "Cd", true, x) - light(x)).norm(), tolerance) << name;
      EXPECT_NEAR(at(back, "density", false, x).x(), at(grids, "density", false, x).x(), tolerance) << name;
    }
    EXPECT_EQ(at(back, "Cd", true, Vec3(0.95, 0.95, 0.95)), Vec3f::Zero()) << name;
  }
}

TEST_F(WriteSlices, ScalarsAreLinearAndPngClipsThem) {
  GridSet set(colored());
  const std::vector<std::string> distances{"surface"};
  set.pick(distances);
  const SampledGrids grids = set.lookUp();
  const SliceLayout stack = planSlices(grids);
  EXPECT_EQ(stack.grid, "surface");
  EXPECT_FALSE(stack.color);
  EXPECT_GT(writeSlices(FramePath(pattern("d.###.png")), grids, stack), 100U) << "negative distances";
  EXPECT_EQ(writeSlices(FramePath(pattern("d.###.exr")), grids, stack), 0U);
  const Vec3 place(0.9, 0.1, 0.05);
  const float distance = at(grids, "surface", false, place).x();
  ASSERT_LT(distance, 0);
  EXPECT_NEAR(at(readSlices(pattern("d.###.exr"), stack.place), "Cd", true, place).x(), distance, 1e-6);
  const Vec3 outside(1.2, 0.1, 0.05);
  EXPECT_NEAR(at(readSlices(pattern("d.###.png"), stack.place), "Cd", true, outside).x(),
              at(grids, "surface", false, outside).x(), 1e-4);
}

TEST_F(WriteSlices, LayersKeepTheirShape) {
  // A block that is not as deep as wide, whose voxels are no cubes: every pixel comes back.
  SliceVolume volume(3, 2, Vec3(1, 0.5, 2), Vec3(10, 20, 30), false);
  std::vector<SliceVolume::Pixel> pixels(6);
  for (int z = 0; z < 4; ++z) {
    for (int i = 0; i < 6; ++i) pixels[i].color = Vec3f(0.1f * i, 0.2f * z, 0.5f);
    volume.addSlice(pixels);
  }
  const SampledGrids grids = volume.finish();
  const SliceLayout stack = planSlices(grids);
  EXPECT_EQ(stack.width, 3);
  EXPECT_EQ(stack.height, 2);
  EXPECT_EQ(stack.count, 4);
  EXPECT_FALSE(stack.alpha);
  EXPECT_LT((stack.place.origin - Vec3(10, 20, 30)).norm(), 1e-12);
  EXPECT_LT((stack.place.voxelSize - Vec3(1, 0.5, 2)).norm(), 1e-12);
  writeSlices(FramePath(pattern("b.#.exr")), grids, stack);
  const SampledGrids back = readSlices(pattern("b.#.exr"), stack.place);
  for (int z = 0; z < 4; ++z) {
    for (int i = 0; i < 6; ++i) {
      const Vec3 x(10.5 + i % 3, 20.75 - 0.5 * (i / 3), 31 + 2 * z);
      EXPECT_LT((at(back, "Cd", true, x) - Vec3f(0.1f * i, 0.2f * z, 0.5f)).norm(), 1e-6);
    }
  }
}

// A file that cannot grow is what a full disk looks like.
TEST_F(WriteSlices, NoticeAFullDisk) {
  const SampledGrids grids = colored();
  const SliceLayout stack = planSlices(grids);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{200, before.rlim_max};
  for (const char* name : {"f.##.png", "f.##.tif", "f.##.exr"}) {
    setrlimit(RLIMIT_FSIZE, &small);
    EXPECT_THROW(writeSlices(FramePath(pattern(name)), grids, stack), Error) << name;
    setrlimit(RLIMIT_FSIZE, &before);
  }
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(folder_.entries(), 0U);
}

TEST_F(WriteSlices, SayWhatToPick) {
  GridSet set(colored());
  const std::vector<std::string> noColors{"surface"};
  set.drop(noColors);
  set.rename("density", "smoke");
  set.rename("Cd", "velocity");
  EXPECT_EQ(planSlices(set.lookUp()).grid, "smoke");
  const std::vector<std::string> vectors{"velocity"};
  set.pick(vectors);
  try {
    planSlices(set.lookUp());
    ADD_FAILURE() << "planned";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::usage);
    EXPECT_THAT(error.what(), HasSubstr("velocity"));
  }
  for (const char* name : {"a.png", "A.TIF", "b.exr"}) EXPECT_TRUE(isSliceOutputName(name));
  EXPECT_FALSE(isSliceOutputName("a.jpg"));
}

}  // namespace
}  // namespace polestar
