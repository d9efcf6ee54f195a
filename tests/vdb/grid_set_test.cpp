// Grids chosen, renamed, halved, turned, resampled and packed; read back with OpenVDB alone.
#include "polestar/vdb/grid_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "support/scratch_folder.h"
#include "vdb/read_vdb.h"

namespace polestar {
namespace {

using test::FileGrid;
using test::Index;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kVoxel = 0.1, kRadius = 1.5;
const Vec3 kShift(3, -2, 7);

double heat(const Vec3& x) { return 3 + x.x() - 2 * x.y() + 0.5 * x.z(); }
Vec3 wind(const Vec3& x) { return {x.y(), 1 - x.z(), 2 * x.x()}; }
openvdb::Vec3s single(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}
Vec3 vectorOf(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

TriMesh ball(double radius, const Vec3& center, int levels = 5) {
  return transformed(icosphere(levels), [&](const Vec3& v) -> Vec3 { return center + radius * v; });
}
TriMesh together(const TriMesh& a, const TriMesh& b) {
  TriMesh both = a;
  const auto first = static_cast<std::int32_t>(a.vertices.size());
  both.vertices.insert(both.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Triangle& t : b.triangles) both.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return both;
}

class GridSets : public ::testing::Test {
 protected:
  /// Active where the ball |x - kShift| < kRadius is.
  template <class Grid, class Function>
  typename Grid::Ptr add(const std::string& name, Function&& value) {
    openvdb::initialize();
    auto grid = Grid::create();
    grid->setName(name);
    auto transform = openvdb::math::Transform::createLinearTransform(kVoxel);
    transform->postTranslate(openvdb::Vec3d(kShift.x(), kShift.y(), kShift.z()));
    grid->setTransform(transform);
    auto accessor = grid->getAccessor();
    test::forEachIndex({-15, -15, -15}, {15, 15, 15}, [&](const Index& i) {
      const Vec3 x = kVoxel * test::toVec3(i);
      if (x.norm() < kRadius) accessor.setValue({i[0], i[1], i[2]}, value(Vec3(kShift + x)));
    });
    grids_.push_back(grid);
    return grid;
  }
  openvdb::Vec3SGrid::Ptr addWind(const std::string& name, openvdb::VecType type) {
    auto grid = add<openvdb::Vec3SGrid>(name, [](const Vec3& x) { return single(wind(x)); });
    grid->setVectorType(type);
    return grid;
  }
  openvdb::FloatGrid::Ptr addHeat() {
    return add<openvdb::FloatGrid>("heat", [](const Vec3& x) { return static_cast<float>(heat(x)); });
  }

  std::filesystem::path saved(const openvdb::MetaMap& metadata = {}) {
    openvdb::io::File file((folder_ / "old.vdb").string());
    file.write(grids_, metadata);
    file.close();
    return folder_ / "old.vdb";
  }
  std::map<std::string, FileGrid> written(const GridSet& set,
                                          VdbCompression compression = VdbCompression::blosc) {
    set.write(folder_ / "new.vdb", compression);
    return test::readVdb(folder_ / "new.vdb");
  }
  template <class Act>
  static std::string refusal(Errc code, Act&& act) {
    try {
      act();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return "";
  }

  test::ScratchFolder folder_;
  openvdb::GridPtrVec grids_;
};

Vec3 placeOf(const FileGrid& grid, const Index& i) { return grid.origin + grid.voxelSize * test::toVec3(i); }

TEST_F(GridSets, AreChosenAndRenamed) {
  addHeat();
  addWind("Cd", openvdb::VEC_INVARIANT);
  addWind("rest", openvdb::VEC_INVARIANT);
  const auto old = saved();
  const auto namesAfter = [&](auto&& change) {
    GridSet set(old);
    change(set);
    std::vector<std::string> names;
    for (const GridInfo& grid : set.describe()) names.push_back(grid.name);
    return names;
  };
  const std::vector<std::string> two{"rest", "heat"}, all{"heat", "Cd", "rest"}, none{"none"};
  EXPECT_THAT(namesAfter([&](GridSet& set) { set.pick(two); }), ElementsAre("heat", "rest"));
  EXPECT_THAT(namesAfter([&](GridSet& set) { set.drop(two); }), ElementsAre("Cd"));
  EXPECT_THAT(namesAfter([&](GridSet& set) { set.rename("Cd", "color"); }),
              ElementsAre("heat", "color", "rest"));
  GridSet set(old);
  EXPECT_THAT(refusal(Errc::usage, [&] { set.pick(none); }), HasSubstr("heat, Cd, rest"));
  EXPECT_THAT(refusal(Errc::usage, [&] { set.rename("Cd", "heat"); }), HasSubstr("already"));
  EXPECT_THAT(refusal(Errc::usage, [&] { set.rename("Cd", "a b"); }), HasSubstr("spaces"));
  EXPECT_THAT(refusal(Errc::usage, [&] { set.drop(all); }), HasSubstr("no grid would be left"));
}

TEST_F(GridSets, HalvesSpareWhatTheyWouldSpoil) {
  addHeat();
  for (const char* name : {"rest", "position"}) addWind(name, openvdb::VEC_INVARIANT);
  add<openvdb::FloatGrid>("green", [](const Vec3&) { return 1.0f; });
  add<openvdb::FloatGrid>("hot", [](const Vec3& x) { return x.x() > 4 ? 70000.0f : 1.0f; });
  add<openvdb::Int32Grid>("region", [](const Vec3&) { return 3; });
  GridSet set(saved());
  EXPECT_EQ(set.halve().size(), 5U);
  set.write(folder_ / "new.vdb");
  openvdb::io::File file((folder_ / "new.vdb").string());
  file.open();
  const auto all = file.getGrids();
  for (const auto& grid : *all)
    EXPECT_EQ(grid->saveFloatAsHalf(), grid->getName() == "heat") << grid->getName();
}

TEST_F(GridSets, KeepWhatFilesAndGridsSay) {
  auto warm = addHeat();
  warm->insertMeta("author", openvdb::StringMetadata("somebody"));
  warm->insertMeta("polestar:map_hash", openvdb::StringMetadata("abc"));
  openvdb::MetaMap metadata;
  metadata.insertMeta("shot", openvdb::StringMetadata("s01"));
  const auto old = saved(metadata);
  GridSet set(old);
  set.setMetadata("polestar:converted", std::string("now"));
  std::map<std::string, std::uintmax_t> sizes;
  for (const VdbCompression compression :
       {VdbCompression::blosc, VdbCompression::zip, VdbCompression::none}) {
    const FileGrid after = written(set, compression).at("heat");
    EXPECT_EQ(after.metadata.at("author"), "string somebody");
    EXPECT_EQ(after.metadata.at("polestar:map_hash"), "string abc");
    EXPECT_EQ(after.metadata.at("polestar:converted"), "string now");
    test::forEachIndex(after.activeMin, after.activeMax, [&](const Index& i) {
      if (after.active(i)) {
        EXPECT_EQ(after.value(i)[0], static_cast<float>(heat(placeOf(after, i))));
      }
    });
    openvdb::io::File file((folder_ / "new.vdb").string());
    file.open();
    EXPECT_EQ(file.getMetadata()->metaValue<std::string>("shot"), "s01");
    sizes[after.metadata.at("file_compression")] = std::filesystem::file_size(folder_ / "new.vdb");
  }
  ASSERT_EQ(sizes.size(), 3U);
  const auto plain = sizes.at("string active values");
  EXPECT_LT(sizes.at("string blosc + active values"), plain);
  EXPECT_LT(sizes.at("string zip + active values"), plain);
}

TEST_F(GridSets, TurnWithoutSampling) {
  auto warm = addHeat();
  warm->insertMeta("polestar:center", openvdb::Vec3DMetadata({1, 2, 3}));
  warm->insertMeta("polestar:map_hash", openvdb::StringMetadata("abc"));
  addWind("rest", openvdb::VEC_INVARIANT);
  addWind("vel", openvdb::VEC_CONTRAVARIANT_RELATIVE);
  addWind("place", openvdb::VEC_CONTRAVARIANT_ABSOLUTE);
  const auto old = saved();
  // Back to where a point was: the inverse of what `up` says.
  const auto back = [](const Vec3& x, UpAxis up) -> Vec3 {
    return up == UpAxis::z ? Vec3(x.x(), x.z(), -x.y()) : Vec3(x.x(), -x.z(), x.y());
  };
  for (const UpAxis up : {UpAxis::z, UpAxis::y}) {
    GridSet set(old);
    EXPECT_THAT(set.turn(up), IsEmpty());
    const auto after = written(set);
    for (const auto& [name, grid] : after) {
      EXPECT_EQ(grid.activeCount, warm->activeVoxelCount());
      EXPECT_TRUE(grid.uniformLinear);
      EXPECT_FALSE(grid.metadata.contains("polestar:map_hash"));
      test::forEachIndex(grid.activeMin, grid.activeMax, [&, &name = name, &grid = grid](const Index& i) {
        if (!grid.active(i)) return;
        const Vec3 was = back(placeOf(grid, i), up);
        if (name == "heat") {
          EXPECT_NEAR(grid.value(i)[0], heat(was), 1e-5);
          return;
        }
        const Vec3 value = vectorOf(grid.value(i));
        EXPECT_LT(((name == "rest" ? value : back(value, up)) - wind(was)).norm(), 1e-5) << name;
      });
    }
    EXPECT_EQ(after.at("heat").metadata.at("polestar:center"),
              up == UpAxis::z ? "vec3d [1, -3, 2]" : "vec3d [1, 3, -2]");
    // And back: the same voxels at the same places.
    set.turn(up == UpAxis::z ? UpAxis::y : UpAxis::z);
    const FileGrid again = written(set).at("heat");
    const Index low = again.activeMin;
    EXPECT_EQ(low, (Index{-14, -14, -14}));
    EXPECT_LT((again.origin - kShift).norm(), 1e-14);
  }
}

TEST_F(GridSets, TurnNodesTilesAndLopsidedVoxels) {
  // A level set has insides in tiles; its other transform is neither uniform nor straight.
  GridSet set(ball(2, kShift), {.voxelSize = 0.05});
  set.turn(UpAxis::z);
  const FileGrid turned = written(set).at("surface");
  const Vec3 center(kShift.x(), -kShift.z(), kShift.y());
  test::forEachIndex({-2, -2, -2}, {2, 2, 2}, [&](const Index& i) {
    const Vec3 at = center + 0.6 * test::toVec3(i);
    Index index;
    for (int k = 0; k < 3; ++k)
      index[k] = static_cast<int>(std::lround((at[k] - turned.origin[k]) / turned.voxelSize));
    const double distance = (placeOf(turned, index) - center).norm() - 2;
    EXPECT_NEAR(turned.value(index)[0], std::clamp(distance, -0.15, 0.15), 0.01);
  });

  auto skewed = addHeat();
  const double numbers[] = {0.1, 0.02, 0, 0, 0, 0.2, 0.03, 0, 0, 0, 0.3, 0, 1, 2, 3, 1};
  const openvdb::Mat4d rows(numbers);
  skewed->setTransform(openvdb::math::Transform::createLinearTransform(rows));
  GridSet askew(saved());
  askew.turn(UpAxis::y);
  askew.write(folder_ / "askew.vdb");
  openvdb::io::File file((folder_ / "askew.vdb").string());
  file.open();
  const auto after = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("heat"));
  for (auto on = after->cbeginValueOn(); on; ++on) {
    const openvdb::Vec3d x = after->indexToWorld(on.getCoord());
    const openvdb::Vec3d index = skewed->worldToIndex(openvdb::Vec3d(x.x(), -x.z(), x.y()));
    const openvdb::Coord nearest = openvdb::Coord::round(index);
    ASSERT_LT((index - nearest.asVec3d()).length(), 1e-9);
    ASSERT_EQ(*on, skewed->tree().getValue(nearest));
  }
}

TEST_F(GridSets, ResampleDistancesFogsAndValues) {
  GridSet set(ball(kRadius, kShift), {.voxelSize = kVoxel});
  set.provide(true, true, 0, 3);
  for (const double voxel : {0.25, 0.04}) {
    set.write(folder_ / "old.vdb");
    const FileGrid before = test::readVdb(folder_ / "old.vdb").at("density");
    GridSet next(folder_ / "old.vdb");
    EXPECT_THAT(next.resample(voxel), IsEmpty());
    const auto after = written(next);
    const FileGrid &surface = after.at("surface"), &density = after.at("density");
    EXPECT_EQ(surface.gridClass, "level set");
    EXPECT_FLOAT_EQ(surface.background[0], static_cast<float>(3 * voxel));
    test::forEachIndex(surface.activeMin, surface.activeMax, [&](const Index& i) {
      const double distance = (placeOf(surface, i) - kShift).norm() - kRadius;
      if (surface.active(i)) {
        EXPECT_NEAR(surface.value(i)[0], distance, 0.004);
      }
    });
    const auto mass = [](const FileGrid& fog) {
      double sum = 0;
      test::forEachIndex(fog.activeMin, fog.activeMax, [&](const Index& i) { sum += fog.value(i)[0]; });
      return sum * std::pow(fog.voxelSize, 3);
    };
    EXPECT_NEAR(mass(density), mass(before), 0.005 * mass(before));
    EXPECT_EQ(surface.origin, density.origin);
  }
}

TEST_F(GridSets, ResampleEveryType) {
  addHeat();
  addWind("rest", openvdb::VEC_INVARIANT);
  add<openvdb::Int32Grid>("region", [](const Vec3& x) { return x.x() < kShift.x() ? 1 : 2; });
  add<openvdb::DoubleGrid>("exact", [](const Vec3& x) { return heat(x); });
  grids_.front()->insertMeta("polestar:certificate", openvdb::StringMetadata("proved"));
  GridSet set(saved());
  EXPECT_THAT(set.resample(0.16), IsEmpty());
  set.write(folder_ / "new.vdb");
  openvdb::io::File file((folder_ / "new.vdb").string());
  file.open();
  const auto warm = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("heat"));
  const auto rest = openvdb::gridPtrCast<openvdb::Vec3SGrid>(file.readGrid("rest"));
  const auto region = openvdb::gridPtrCast<openvdb::Int32Grid>(file.readGrid("region"));
  const auto exact = openvdb::gridPtrCast<openvdb::DoubleGrid>(file.readGrid("exact"));
  EXPECT_FALSE((*warm)["polestar:certificate"]);
  std::size_t seen = 0;
  for (auto on = warm->cbeginValueOn(); on; ++on) {
    const openvdb::Vec3d at = warm->indexToWorld(on.getCoord());
    const Vec3 x(at.x(), at.y(), at.z());
    if ((x - kShift).norm() > kRadius - 0.6) continue;  // averages near the edge are one-sided
    ++seen;
    EXPECT_NEAR(*on, heat(x), 1e-4);
    const openvdb::Vec3s r = rest->tree().getValue(on.getCoord());
    EXPECT_LT((Vec3(r.x(), r.y(), r.z()) - wind(x)).norm(), 1e-4);
    EXPECT_NEAR(exact->tree().getValue(on.getCoord()), heat(x), 1e-9);
    if (std::abs(x.x() - kShift.x()) > kVoxel) {
      EXPECT_EQ(region->tree().getValue(on.getCoord()), x.x() < kShift.x() ? 1 : 2);
    }
  }
  EXPECT_GT(seen, 150U);
}

TEST_F(GridSets, TheSameVoxelsStayTheSame) {
  addHeat();
  GridSet set(saved());
  set.resample(kVoxel);
  const FileGrid after = written(set).at("heat");
  EXPECT_EQ(after.activeCount, grids_.front()->activeVoxelCount());
  test::forEachIndex(after.activeMin, after.activeMax, [&](const Index& i) {
    if (after.active(i)) {
      EXPECT_NEAR(after.value(i)[0], heat(placeOf(after, i)), 1e-5);
    }
  });
}

TEST_F(GridSets, LevelSetsAndFogsBecomeOneAnother) {
  GridSet set(ball(kRadius, kShift), {.voxelSize = kVoxel});
  set.setMetadata("polestar:source", std::string("ball"));
  set.write(folder_ / "surface.vdb");
  GridSet fog(folder_ / "surface.vdb");
  fog.provide(false, true, 0, 3);
  const FileGrid density = written(fog).at("density");
  EXPECT_EQ(density.gridClass, "fog volume");
  EXPECT_EQ(density.metadata.at("polestar:source"), "string ball");
  test::forEachIndex(density.activeMin, density.activeMax, [&](const Index& i) {
    const double distance = (placeOf(density, i) - kShift).norm() - kRadius;
    EXPECT_NEAR(density.value(i)[0], std::clamp(0.5 - 0.5 * distance / kVoxel, 0.0, 1.0), 0.02);
  });
  GridSet back(folder_ / "new.vdb");
  back.provide(true, false, 0.5, 3);
  const FileGrid surface = written(back).at("surface");
  EXPECT_EQ(surface.gridClass, "level set");
  test::forEachIndex(surface.activeMin, surface.activeMax, [&](const Index& i) {
    const double distance = (placeOf(surface, i) - kShift).norm() - kRadius;
    if (surface.active(i)) {
      EXPECT_NEAR(surface.value(i)[0], distance, 0.05 * kVoxel);
    }
  });

  addHeat();
  EXPECT_THAT(refusal(Errc::io, [&] { GridSet(saved()).provide(true, false, 0.5, 3); }), HasSubstr("heat"));
  GridSet dense(folder_ / "surface.vdb");
  dense.provide(true, true, 0.5, 3);
  const std::vector<std::string> only{"density"};
  dense.pick(only);
  EXPECT_THAT(refusal(Errc::io, [&] { dense.provide(true, false, 7, 3); }), HasSubstr("--iso"));
}

TEST_F(GridSets, UniteWhatOverlapsAndKeepCavities) {
  const double voxel = 0.1;
  const TriMesh pair = together(ball(1, Vec3::Zero(), 4), ball(1, Vec3(1, 0, 0), 4));
  const FileGrid united = written(GridSet(pair, {.voxelSize = voxel})).at("surface");
  TriMesh inner = ball(0.5, Vec3::Zero(), 4);
  for (Triangle& t : inner.triangles) std::swap(t[1], t[2]);
  const TriMesh hollow = together(ball(1, Vec3::Zero(), 4), inner);
  const FileGrid kept = written(GridSet(hollow, {.voxelSize = voxel, .exact = true})).at("surface");
  const auto at = [](const FileGrid& grid, const Vec3& x) {
    Index index;
    for (int k = 0; k < 3; ++k)
      index[k] = static_cast<int>(std::lround((x[k] - grid.origin[k]) / grid.voxelSize));
    return grid.value(index)[0];
  };
  for (const double x : {-0.5, 0.5, 1.5}) EXPECT_LT(at(united, Vec3(x, 0, 0)), -0.2) << x;
  EXPECT_GT(at(united, Vec3(0.5, 1.3, 0)), 0);
  EXPECT_GT(at(kept, Vec3::Zero()), 0);
  EXPECT_LT(at(kept, Vec3(0.75, 0, 0)), -0.1);
  EXPECT_NEAR(at(kept, Vec3(0.4, 0, 0)), 0.1, 0.03 + voxel / 2);
}

TEST_F(GridSets, PruneMakesTiles) {
  add<openvdb::FloatGrid>("density", [](const Vec3& x) { return x.x() > kShift.x() ? 0.501f : 0.499f; });
  const auto old = saved();
  GridSet set(old);
  set.prune(0.01);
  set.write(folder_ / "new.vdb");
  openvdb::io::File file((folder_ / "new.vdb").string());
  file.open();
  const auto after = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
  EXPECT_LT(after->tree().leafCount(),
            openvdb::gridPtrCast<openvdb::FloatGrid>(grids_.front())->tree().leafCount());
  EXPECT_EQ(after->activeVoxelCount(), grids_.front()->activeVoxelCount());
}

TEST_F(GridSets, RefuseWhatCannotBe) {
  add<openvdb::FloatGrid>("surface", [](const Vec3& x) {
    return x.x() > kShift.x() + 1 ? std::numeric_limits<float>::quiet_NaN()
                                  : static_cast<float>((x - kShift).norm() - 1);
  })->setGridClass(openvdb::GRID_LEVEL_SET);
  GridSet set(saved());
  EXPECT_THAT(refusal(Errc::io, [&] { set.resample(0.2); }), HasSubstr("no number"));
  EXPECT_THAT(refusal(Errc::io, [&] { set.provide(false, true, 0, 3); }), HasSubstr("no number"));
  refusal(Errc::usage, [&] { set.resample(0); });
  grids_.clear();
  addHeat();
  refusal(Errc::usage, [&] { GridSet(saved()).resample(1e-9); });
  refusal(Errc::io, [&] { GridSet(folder_ / "none.vdb"); });
  Context context;
  context.cancel();
  refusal(Errc::cancelled, [&] { GridSet(icosphere(3), {.voxelSize = 0.02}, context); });
}

}  // namespace
}  // namespace polestar
