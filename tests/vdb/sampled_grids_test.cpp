// Grids looked up at points and over footprints, against functions with known averages.
#include "polestar/vdb/sampled_grids.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "polestar/core/error.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

constexpr double kVoxel = 0.1;

class SampledGridsTest : public ::testing::Test {
 protected:
  /// Active on |index| <= half along each axis; anything elsewhere.
  template <class Grid, class Function>
  void add(const std::string& name, Function&& value, int half = 24) {
    openvdb::initialize();
    auto grid = Grid::create(typename Grid::ValueType(-77.0f));
    grid->setName(name);
    const auto transform = openvdb::math::Transform::createLinearTransform(kVoxel);
    transform->postTranslate(openvdb::Vec3d(5, 0, 0));
    grid->setTransform(transform);
    auto accessor = grid->getAccessor();
    for (int i = -half; i <= half; ++i) {
      for (int j = -half; j <= half; ++j) {
        for (int k = -half; k <= half; ++k)
          accessor.setValue(openvdb::Coord(i, j, k), value(kVoxel * Vec3(i, j, k)));
      }
    }
    grids_.push_back(grid);
  }
  SampledGrids written() const {
    const std::filesystem::path path = folder_ / "grids.vdb";
    openvdb::io::File(path.string()).write(grids_);
    return SampledGrids(path);
  }
  static Vec3 world(const Vec3& place) { return place + Vec3(5, 0, 0); }

  struct Answer {
    Vec3f value;
    float weight;
  };
  static Answer ask(const SampledGrid& grid, const Vec3& place, const Mat3& footprint = Mat3::Zero()) {
    const Vec3 point = world(place);
    Answer answer{};
    grid.sample({&point, 1}, {&footprint, 1}, {&answer.value, 1}, {&answer.weight, 1});
    return answer;
  }

  test::ScratchFolder folder_;
  openvdb::GridPtrVec grids_;
};

TEST_F(SampledGridsTest, ReadsLinearFunctionsAsTheyAre) {
  // Large enough that the coarsest voxels that are read lie inside.
  constexpr int kHalf = 48;
  add<openvdb::FloatGrid>(
      "heat", [](const Vec3& x) { return static_cast<float>(1 + x.x() - 2 * x.z()); }, kHalf);
  add<openvdb::Vec3SGrid>(
      "Cd", [](const Vec3& x) { return openvdb::Vec3s(x.x(), x.y(), x.z()); }, kHalf);
  const SampledGrids grids = written();
  ASSERT_NE(grids.find("Cd", true), nullptr);
  EXPECT_EQ(grids.find("Cd", false), nullptr);
  const SampledGrid &heat = *grids.find("heat", false), &color = *grids.find("Cd", true);
  EXPECT_NEAR(heat.voxelSize(), kVoxel, 1e-12);
  EXPECT_NEAR(heat.activeBox().max.x(), 5 + kHalf * kVoxel, 1e-9);
  // Also over footprints, of any shape: the mean of a linear function is its value in the middle.
  Mat3 slanted;
  slanted << 0.4, 0.1, 0, 0, 0.5, 0.05, 0.1, 0, 0.3;
  for (const Mat3& footprint : {Mat3(Mat3::Zero()), slanted, Mat3(3 * slanted)}) {
    for (const Vec3& place : {Vec3(0.33, -0.27, 0.11), Vec3(-0.6, 0.5, 0.02)}) {
      const Answer h = ask(heat, place, footprint), c = ask(color, place, footprint);
      EXPECT_NEAR(h.value.x(), 1 + place.x() - 2 * place.z(), 2e-5);
      EXPECT_LT((c.value.cast<double>() - place).norm(), 2e-5);
      EXPECT_NEAR(c.weight, 1, 1e-5);
    }
  }
}

// Color next to the edge of what is there: the background bleeds into nothing, only the weight tells.
TEST_F(SampledGridsTest, EdgesKeepTheirColor) {
  add<openvdb::Vec3SGrid>(
      "Cd", [](const Vec3&) { return openvdb::Vec3s(0.25f, 0.5f, 0.75f); }, 10);
  const SampledGrids grids = written();
  const SampledGrid& color = *grids.find("Cd", true);
  const double edge = 10 * kVoxel;
  for (const double width : {0.0, 0.4, 1.0}) {
    const Answer answer = ask(color, Vec3(edge + 0.04, 0, 0), width * Mat3::Identity());
    EXPECT_LT((answer.value - Vec3f(0.25f, 0.5f, 0.75f)).norm(), 1e-5) << width;
    EXPECT_GT(answer.weight, 0);
    EXPECT_LT(answer.weight, 1);
  }
  const Answer outside = ask(color, Vec3(edge + 0.3, 0, 0));
  EXPECT_EQ(outside.weight, 0);
  EXPECT_EQ(outside.value, Vec3f(Vec3f::Zero()));
}

// A wave of 1 along x: a filter as wide as w along it leaves about sin(pi w) / (pi w) of it, and all of it
// across.
TEST_F(SampledGridsTest, FiltersAlongTheFootprintAlone) {
  const auto wave = [](const Vec3& x) { return static_cast<float>(std::cos(2 * std::numbers::pi * x.x())); };
  add<openvdb::FloatGrid>("wave", wave, 40);
  const SampledGrids grids = written();
  const SampledGrid& grid = *grids.find("wave", false);
  for (const double width : {0.3, 0.5, 1.0, 1.5}) {
    const double left = std::sin(std::numbers::pi * width) / (std::numbers::pi * width);
    const Answer along = ask(grid, Vec3::Zero(), Vec3(width, 0.05, 0.05).asDiagonal());
    EXPECT_NEAR(along.value.x(), left, 0.06) << width;
    const Answer across = ask(grid, Vec3::Zero(), Vec3(0.05, width, 0.05).asDiagonal());
    EXPECT_GT(across.value.x(), 0.9) << width;
  }
  // All around, coarse: nothing is left of it.
  EXPECT_NEAR(ask(grid, Vec3(0.07, 0, 0), 2 * Mat3::Identity()).value.x(), 0, 0.06);
}

TEST_F(SampledGridsTest, CountsWhatIsNoNumber) {
  add<openvdb::Vec3SGrid>("Cd", [](const Vec3& x) {
    const bool here = std::abs(x.x() - 0.5) < 0.05 && std::abs(x.y()) < 0.15 && std::abs(x.z()) < 0.05;
    const float bad = here ? std::numeric_limits<float>::quiet_NaN() : 1;
    return openvdb::Vec3s(1, bad, 1);
  });
  const SampledGrids grids = written();
  const SampledGrid::NotFinite bad = grids.find("Cd", true)->notFinite();
  EXPECT_EQ(bad.count, 3U);
  EXPECT_NEAR(bad.first.x(), 5.5, 1e-6);
}

TEST(SampledGridsSurface, IsClosedOutwardAndWhereItWas) {
  const test::ScratchFolder folder;
  for (const Vec3& center : {Vec3(0, 0, 0), Vec3(1e6, -2e6, 3e6)}) {
    const TriMesh ball = transformed(icosphere(5), [&](const Vec3& v) -> Vec3 { return center + 2 * v; });
    SolidGrids(ball, {.voxelSize = 0.1}).write(folder / "ball.vdb");
    const std::optional<TriMesh> surface = SampledGrids(folder / "ball.vdb").extractSurface();
    ASSERT_TRUE(surface);
    EXPECT_TRUE(inspectSurface(*surface).valid) << inspectSurface(*surface).defect;
    EXPECT_NEAR(volumeProperties(*surface).volume, volumeProperties(ball).volume, 0.01 * 33.5);
    for (const Vec3& v : surface->vertices) EXPECT_NEAR((v - center).norm(), 2, 0.01);
  }
}

TEST(SampledGridsFile, ThatIsNoneIsRefused) {
  const test::ScratchFolder folder;
  EXPECT_THROW(SampledGrids(folder / "missing.vdb"), Error);
}

}  // namespace
}  // namespace polestar
