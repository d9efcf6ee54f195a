// Grids of every kind through maps with a formula, read back with OpenVDB alone.
#include "polestar/vdb/warp_grids.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/scratch_folder.h"
#include "support/solids.h"
#include "vdb/read_vdb.h"

namespace polestar {
namespace {

using test::FileGrid;
using test::Index;
using ::testing::HasSubstr;

constexpr double kOldVoxel = 0.1;

/// y = A x + b of the ball |x| < 2: what a map does is known everywhere.
struct Affine {
  Mat3 a = Mat3::Identity();
  Vec3 b = Vec3::Zero();

  GridWarp warp() const {
    const Mat3 back = a.inverse();
    const auto inside = [](const Vec3& x) {
      return x.norm() < 2 ? x : Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    };
    return {[=, *this](std::span<const Vec3> y, std::span<Vec3> x) {
              for (std::size_t i = 0; i < y.size(); ++i) x[i] = inside(back * (y[i] - b));
            },
            [=, *this](std::span<const Vec3> x, std::span<Vec3> y) {
              for (std::size_t i = 0; i < x.size(); ++i) y[i] = a * inside(x[i]) + b;
            },
            [*this](std::span<const Vec3> x, std::span<Mat3> d) {
              for (std::size_t i = 0; i < x.size(); ++i) d[i] = a;
            }};
  }
  WarpGridsOptions options(double voxel) const {
    WarpGridsOptions result;
    const Vec3 half = 2 * a.rowwise().norm();
    result.box = {b - half, b + half};
    result.voxelSize = voxel;
    return result;
  }
};

Affine turnedAndStretched() {
  Affine map;
  map.a << 0, -2, 0, 1, 0, 0, 0, 0.3, 1.5;
  map.b = Vec3(10, 20, 30);
  return map;
}

/// Linear functions, which trilinear reading keeps: every value is known.
double heat(const Vec3& x) { return 3 + x.x() - 2 * x.y() + 0.5 * x.z(); }
Vec3 wind(const Vec3& x) { return {x.y(), 1 - x.z(), 2 * x.x()}; }

class WarpGrids : public ::testing::Test {
 protected:
  /// Active on a box around the ball.
  template <class Grid, class Function>
  typename Grid::Ptr add(const std::string& name, Function&& value) {
    openvdb::initialize();
    auto grid = Grid::create();
    grid->setName(name);
    auto transform = openvdb::math::Transform::createLinearTransform(kOldVoxel);
    grid->setTransform(transform);
    auto accessor = grid->getAccessor();
    for (int i = -24; i <= 24; ++i) {
      for (int j = -24; j <= 24; ++j) {
        for (int k = -24; k <= 24; ++k)
          accessor.setValue({i, j, k}, value(Vec3(kOldVoxel * i, kOldVoxel * j, kOldVoxel * k)));
      }
    }
    grids_.push_back(grid);
    return grid;
  }
  openvdb::Vec3SGrid::Ptr addWind(const std::string& name, openvdb::VecType type) {
    auto grid = add<openvdb::Vec3SGrid>(name, [](const Vec3& x) {
      const Vec3 w = wind(x);
      return openvdb::Vec3s(static_cast<float>(w.x()), static_cast<float>(w.y()), static_cast<float>(w.z()));
    });
    grid->setVectorType(type);
    return grid;
  }

  std::filesystem::path saved() {
    openvdb::io::File file((folder_ / "old.vdb").string());
    file.write(grids_);
    file.close();
    return folder_ / "old.vdb";
  }

  std::map<std::string, FileGrid> carried(const Affine& map, double voxel = 0.15) {
    WarpedGrids result(saved(), map.warp(), map.options(voxel));
    report_ = result.report();
    inside_ = result.voxelsInside();
    result.setMetadata("polestar:domain", std::string("test"));
    result.write(folder_ / "new.vdb");
    return test::readVdb(folder_ / "new.vdb");
  }

  /// Calls expect(value, x, y) at active voxels and checks that they are those inside.
  template <class Expect>
  void expectEverywhere(const FileGrid& grid, const Affine& map, Expect&& expect) {
    const Mat3 back = map.a.inverse();
    std::size_t active = 0;
    test::forEachIndex(grid.activeMin, grid.activeMax, [&](const Index& i) {
      const Vec3 y = grid.origin + grid.voxelSize * test::toVec3(i), x = back * (y - map.b);
      if (std::abs(x.norm() - 2) > 1e-9) {
        EXPECT_EQ(grid.active(i), x.norm() < 2);
      }
      if (!grid.active(i)) return;
      ++active;
      const std::array<float, 3> value = grid.value(i);
      expect(Vec3(value[0], value[1], value[2]), x, y);
    });
    EXPECT_EQ(active, inside_);
    EXPECT_EQ(active, grid.activeCount);
    const double volume = 32.0 / 3 * std::acos(-1.0) * std::abs(map.a.determinant());
    EXPECT_NEAR(static_cast<double>(active) * std::pow(grid.voxelSize, 3), volume, 0.03 * volume);
  }

  test::ScratchFolder folder_;
  openvdb::GridPtrVec grids_;
  std::vector<WarpedGrid> report_;
  std::size_t inside_ = 0;
};

TEST_F(WarpGrids, ScalarsAreReadWhereTheyComeFrom) {
  auto grid = add<openvdb::FloatGrid>("heat", [](const Vec3& x) { return static_cast<float>(heat(x)); });
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->insertMeta("author", openvdb::StringMetadata("somebody"));
  grid->insertMeta("polestar:center", openvdb::StringMetadata("of another map"));
  grid->setSaveFloatAsHalf(true);
  grids_.front()->setSaveFloatAsHalf(false);
  const Affine map = turnedAndStretched();
  const auto after = carried(map);
  const FileGrid& warm = after.at("heat");
  EXPECT_TRUE(warm.uniformLinear);
  EXPECT_DOUBLE_EQ(warm.voxelSize, 0.15);
  EXPECT_EQ(warm.gridClass, "fog volume");
  EXPECT_EQ(warm.metadata.at("author"), "string somebody");
  EXPECT_FALSE(warm.metadata.contains("polestar:center"));
  EXPECT_TRUE(warm.metadata.contains("polestar:domain"));
  EXPECT_EQ(report_[0].how, "interpolated");
  EXPECT_EQ(report_[0].note, "");
  expectEverywhere(
      warm, map, [](const Vec3& value, const Vec3& x, const Vec3&) { EXPECT_NEAR(value[0], heat(x), 1e-5); });
}

TEST_F(WarpGrids, VectorsFollowTheirType) {
  addWind("invariant", openvdb::VEC_INVARIANT);
  addWind("contravariant", openvdb::VEC_CONTRAVARIANT_RELATIVE);
  addWind("covariant", openvdb::VEC_COVARIANT);
  addWind("normal", openvdb::VEC_COVARIANT_NORMALIZE);
  auto places = add<openvdb::Vec3SGrid>("places", [](const Vec3& x) {
    const Vec3 p = 0.9 * x;
    return openvdb::Vec3s(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
  });
  places->setVectorType(openvdb::VEC_CONTRAVARIANT_ABSOLUTE);
  const Affine map = turnedAndStretched();
  const auto after = carried(map, 0.3);
  const Mat3 gradients = map.a.inverse().transpose();
  const auto expect = [&](const char* name, const auto& value) {
    SCOPED_TRACE(name);
    expectEverywhere(after.at(name), map, [&](const Vec3& found, const Vec3& x, const Vec3&) {
      EXPECT_LT((found - value(x)).norm(), 2e-5);
    });
  };
  expect("invariant", wind);
  expect("contravariant", [&](const Vec3& x) { return Vec3(map.a * wind(x)); });
  expect("covariant", [&](const Vec3& x) { return Vec3(gradients * wind(x)); });
  expect("normal", [&](const Vec3& x) { return Vec3((gradients * wind(x)).normalized()); });
  expect("places", [&](const Vec3& x) { return Vec3(map.a * 0.9 * x + map.b); });
  EXPECT_EQ(after.at("contravariant").vectorType, "contravariant relative");
  EXPECT_EQ(report_[1].how, "as vectors by the Jacobian");
  EXPECT_EQ(report_[2].how, "as covectors by its inverse transpose");
  EXPECT_EQ(report_[4].how, "as positions");
}

TEST_F(WarpGrids, UnderATurnVectorsAndGradientsTurnAlike) {
  addWind("contravariant", openvdb::VEC_CONTRAVARIANT_RELATIVE);
  addWind("covariant", openvdb::VEC_COVARIANT);
  Affine map;
  map.a << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const auto after = carried(map, 0.3);
  for (const char* name : {"contravariant", "covariant"}) {
    expectEverywhere(after.at(name), map, [&](const Vec3& found, const Vec3& x, const Vec3&) {
      EXPECT_LT((found - map.a * wind(x)).norm(), 1e-5);
    });
  }
}

TEST_F(WarpGrids, LevelSetsBecomeUnknownAndKeepTheirInside) {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create(0.3f);
  grid->setName("surface");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(kOldVoxel));
  auto accessor = grid->getAccessor();
  for (int i = -12; i <= 12; ++i) {
    for (int j = -12; j <= 12; ++j) {
      for (int k = -12; k <= 12; ++k) {
        const double distance = kOldVoxel * std::sqrt(i * i + j * j + k * k) - 1;
        if (std::abs(distance) < 0.3) {
          accessor.setValue({i, j, k}, static_cast<float>(distance));
        } else if (distance < 0) {
          accessor.setValueOff({i, j, k}, -0.3f);
        }
      }
    }
  }
  grids_.push_back(grid);
  const Affine map;
  const auto after = carried(map, 0.1);
  EXPECT_EQ(after.at("surface").gridClass, "unknown");
  EXPECT_THAT(report_[0].note, HasSubstr("class unknown"));
  expectEverywhere(after.at("surface"), map, [](const Vec3& value, const Vec3& x, const Vec3&) {
    EXPECT_NEAR(value[0], std::clamp(x.norm() - 1, -0.3, 0.3), 0.03);
  });
}

TEST_F(WarpGrids, WholeNumbersAreNotMixed) {
  add<openvdb::Int32Grid>("region", [](const Vec3& x) { return x.x() < 0 ? 1 : 7; });
  add<openvdb::BoolGrid>("mask", [](const Vec3&) { return true; });
  add<openvdb::DoubleGrid>("fine", [](const Vec3& x) { return heat(x); });
  const Affine map = turnedAndStretched();
  WarpedGrids result(saved(), map.warp(), map.options(0.3));
  result.write(folder_ / "new.vdb");
  openvdb::io::File file((folder_ / "new.vdb").string());
  file.open();
  const auto region = openvdb::gridPtrCast<openvdb::Int32Grid>(file.readGrid("region"));
  const auto mask = openvdb::gridPtrCast<openvdb::BoolGrid>(file.readGrid("mask"));
  const auto fine = openvdb::gridPtrCast<openvdb::DoubleGrid>(file.readGrid("fine"));
  ASSERT_TRUE(region && mask && fine);
  EXPECT_EQ(region->activeVoxelCount(), result.voxelsInside());
  EXPECT_EQ(mask->activeVoxelCount(), result.voxelsInside());
  const Mat3 back = map.a.inverse();
  for (auto voxel = region->cbeginValueOn(); voxel; ++voxel) {
    EXPECT_TRUE(*voxel == 1 || *voxel == 7);
    if (!voxel.isVoxelValue()) continue;
    const auto y = region->indexToWorld(voxel.getCoord());
    const Vec3 x = back * (Vec3(y.x(), y.y(), y.z()) - map.b);
    if (std::abs(x.x()) > 0.06) {
      EXPECT_EQ(*voxel, x.x() < 0 ? 1 : 7);
    }
    EXPECT_NEAR(fine->tree().getValue(voxel.getCoord()), heat(x), 1e-12);
  }
  EXPECT_EQ(result.report()[0].how, "nearest");
}

TEST_F(WarpGrids, StaysSparseWhereTheOldGridIs) {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create();
  grid->setName("puff");
  grid->setTransform(openvdb::math::Transform::createLinearTransform(kOldVoxel));
  grid->fill(openvdb::CoordBBox({3, 3, 3}, {6, 6, 6}), 1.f);
  grids_.push_back(grid);
  const auto after = carried(Affine(), 0.1);
  EXPECT_GT(inside_, 30000u);
  EXPECT_LE(after.at("puff").activeCount, 5u * 5 * 5 + 91);
  EXPECT_GE(after.at("puff").activeCount, 64u);
}

TEST_F(WarpGrids, GridsOfOtherTypesAreLeftOutAndSaidSo) {
  add<openvdb::FloatGrid>("heat", [](const Vec3& x) { return static_cast<float>(heat(x)); });
  auto names = openvdb::createGrid<openvdb::MaskGrid>();
  names->setName("odd");
  names->tree().setValueOn({0, 0, 0});
  grids_.push_back(names);
  const auto after = carried(Affine(), 0.3);
  EXPECT_EQ(after.size(), 1u);
  ASSERT_EQ(report_.size(), 2u);
  EXPECT_EQ(report_[1].how, "");
  EXPECT_THAT(report_[1].note, HasSubstr("left out"));

  grids_ = {names};
  try {
    carried(Affine());
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_THAT(error.what(), HasSubstr("holds no grid"));
  }
}

// The picture of a map, carried by the map itself: `rest` names the place of every voxel.
TEST_F(WarpGrids, RestOfAMapBecomesTheBallItself) {
  const BallMap map = testing::ballMap(testing::starShape(smoothStar(3)));
  gridsOf(map, {.voxelSize = 0.05}).write(folder_ / "old.vdb");
  const GridWarp warp{[&](std::span<const Vec3> y, std::span<Vec3> x) { map.inverse(y, x); },
                      [&](std::span<const Vec3> x, std::span<Vec3> y) { map.forward(x, y); },
                      [&](std::span<const Vec3> x, std::span<Mat3> d) { map.jacobian(x, d); }};
  WarpGridsOptions options;
  options.box = {Vec3::Constant(-1), Vec3::Constant(1)};
  options.voxelSize = 0.1;
  WarpedGrids(folder_ / "old.vdb", warp, options).write(folder_ / "new.vdb");
  const FileGrid rest = test::readVdb(folder_ / "new.vdb").at("rest");
  double sum = 0;
  test::forEachIndex(rest.activeMin, rest.activeMax, [&](const Index& i) {
    const Vec3 y = rest.origin + rest.voxelSize * test::toVec3(i);
    EXPECT_EQ(rest.active(i), y.norm() <= 1);
    if (!rest.active(i)) return;
    const auto value = rest.value(i);
    const double error = (Vec3(value[0], value[1], value[2]) - y).norm();
    EXPECT_LT(error, 0.03) << y.transpose();
    sum += error;
  });
  EXPECT_GT(rest.activeCount, 4000u);
  EXPECT_LT(sum / static_cast<double>(rest.activeCount), 2e-3);
}

TEST_F(WarpGrids, TheSameBytesForAnyNumberOfThreads) {
  add<openvdb::FloatGrid>("heat", [](const Vec3& x) { return static_cast<float>(heat(x)); });
  addWind("wind", openvdb::VEC_CONTRAVARIANT_RELATIVE);
  const auto old = saved();
  const Affine map = turnedAndStretched();
  std::vector<std::string> bytes;
  for (const int threads : {1, 3}) {
    withThreads(threads, [&] { WarpedGrids(old, map.warp(), map.options(0.2)).write(folder_ / "new.vdb"); });
    bytes.push_back(test::bytesOf(folder_ / "new.vdb"));
  }
  EXPECT_TRUE(bytes[0] == bytes[1]);
}

TEST_F(WarpGrids, RefusesWhatCannotBe) {
  add<openvdb::FloatGrid>("heat", [](const Vec3& x) { return static_cast<float>(heat(x)); });
  const auto old = saved();
  const Affine map;
  const auto codeOf = [&](const std::filesystem::path& path, WarpGridsOptions options) {
    try {
      WarpedGrids(path, map.warp(), options);
    } catch (const Error& error) {
      return error.code();
    }
    return Errc::cancelled;
  };
  WarpGridsOptions options = map.options(0.1);
  EXPECT_EQ(codeOf(folder_ / "missing.vdb", options), Errc::io);
  options.memoryLimit = 1000;
  EXPECT_EQ(codeOf(old, options), Errc::usage);
  options.voxelSize = 0;
  EXPECT_EQ(codeOf(old, options), Errc::usage);
  test::writeBytes(folder_ / "cut.vdb", test::bytesOf(old).substr(0, 500));
  EXPECT_EQ(codeOf(folder_ / "cut.vdb", map.options(0.1)), Errc::io);

  Context context;
  context.cancel();
  EXPECT_THROW(WarpedGrids(old, map.warp(), map.options(0.1), context), Error);
}

}  // namespace
}  // namespace polestar
