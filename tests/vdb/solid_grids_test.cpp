// Attribute grids: where they hold values, what the samplers are given, and that the file holds the same
// floats.

#include "polestar/vdb/solid_grids.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <cmath>
#include <map>
#include <mutex>

#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/mesh/shapes.h"
#include "support/scratch_folder.h"
#include "vdb/read_vdb.h"

namespace polestar {
namespace {

using test::FileGrid;
using test::Index;
using test::toVec3;
using ::testing::HasSubstr;
using ::testing::StartsWith;

template <class Call>
Error errorOf(Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no polestar::Error";
  return Error(Errc::usage, "");
}

// Values that tell their point exactly, with bits that a half float or a rounding on the way would lose.
Vec3f stamp(const Vec3& p) { return (p * (1 + 1.0 / 3)).cast<float>(); }

void stampAll(const VoxelBatch& batch, std::span<Vec3f> out) {
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = stamp(batch.points[i]);
}

void copyDistance(const VoxelBatch& batch, std::span<float> out) {
  std::copy(batch.signedDistance.begin(), batch.signedDistance.end(), out.begin());
}

bool sameBits(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

TEST(SolidGrids, SamplesEveryActiveVoxelOnceAndWritesItsFloats) {
  const test::ScratchFolder folder;
  const TriMesh mesh = smoothStar(3);
  SolidGrids grids(mesh, {.voxelSize = voxelSizeFor(mesh, 30)});
  std::mutex mutex;
  std::map<std::array<double, 3>, int> calls;
  grids.addVector("rest", ValueRole::invariant, [&](const VoxelBatch& batch, std::span<Vec3f> out) {
    EXPECT_EQ(batch.points.size(), out.size());
    EXPECT_EQ(batch.signedDistance.size(), out.size());
    stampAll(batch, out);
    const std::scoped_lock lock(mutex);
    for (const Vec3& p : batch.points) ++calls[{p.x(), p.y(), p.z()}];
  });
  std::atomic<std::size_t> insideCalls{0};
  grids.addScalar("green", [&](const VoxelBatch& batch, std::span<float> out) {
    copyDistance(batch, out);
    insideCalls += out.size();
  });
  EXPECT_EQ(calls.size(), grids.activeVoxels());
  for (const auto& [point, count] : calls) EXPECT_EQ(count, 1);
  EXPECT_EQ(insideCalls, grids.insideVoxels());

  grids.write(folder / "a.vdb");
  const auto file = test::readVdb(folder / "a.vdb");
  const FileGrid &surface = file.at("surface"), &rest = file.at("rest"), &green = file.at("green");
  EXPECT_EQ(rest.activeCount, grids.activeVoxels());
  EXPECT_EQ(green.activeCount, grids.insideVoxels());
  test::forEachIndex(rest.activeMin, rest.activeMax, [&](const Index& i) {
    const float distance = surface.value(i)[0];
    const Vec3 p = grids.indexToWorld(toVec3(i));
    const Vec3f expected = rest.active(i) ? stamp(p) : Vec3f(0, 0, 0);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(sameBits(rest.value(i)[k], expected[k]));
    EXPECT_EQ(rest.active(i), calls.contains({p.x(), p.y(), p.z()}));
    EXPECT_EQ(green.active(i), distance < 0);
    EXPECT_TRUE(sameBits(green.value(i)[0], distance < 0 ? distance : 0.f));
  });
}

TEST(SolidGrids, PadsAllVoxelsNearTheSolid) {
  for (const int padding : {0, 1, 3, 5}) {
    const test::ScratchFolder folder;
    const TriMesh mesh = smoothStar(3);
    SolidGrids grids(mesh, {.voxelSize = voxelSizeFor(mesh, 20), .padding = padding});
    grids.addVector("rest", ValueRole::invariant, stampAll);
    grids.write(folder / "a.vdb");
    const auto file = test::readVdb(folder / "a.vdb");
    const FileGrid &surface = file.at("surface"), &rest = file.at("rest");
    const Index low{-7, -7, -7}, high{28, 28, 28};
    std::size_t found = 0;
    test::forEachIndex(low, high, [&](const Index& i) {
      if (!(surface.value(i)[0] < 0)) return;
      test::forEachIndex({i[0] - padding, i[1] - padding, i[2] - padding},
                         {i[0] + padding, i[1] + padding, i[2] + padding}, [&](const Index& j) {
                           if ((toVec3(j) - toVec3(i)).norm() > padding) return;
                           ++found;
                           ASSERT_TRUE(rest.active(j)) << "padding " << padding;
                         });
    });
    EXPECT_GT(found, 1000u);
    // And no more than that: everything else is background.
    test::forEachIndex(low, high, [&](const Index& i) {
      const float bound = static_cast<float>(padding) * static_cast<float>(grids.voxelSize());
      EXPECT_EQ(rest.active(i), surface.value(i)[0] < bound);
    });
  }
}

// The part of a point's lookup that a trilinear or a quadratic filter reads must exist at every point of the
// solid, be it in a blade that no voxel center is inside of.
TEST(SolidGrids, PadsTheFilterOfEveryPointOfAThinBlade) {
  const test::ScratchFolder folder;
  const TriMesh blade =
      transformed(icosphere(4), [](const Vec3& v) { return Vec3(v.x(), v.y(), 0.01 * v.z() + 0.3 * v.x()); });
  SolidGrids grids(blade, {.voxelSize = voxelSizeFor(blade, 24)});
  grids.addVector("rest", ValueRole::invariant, stampAll);
  grids.write(folder / "a.vdb");
  const FileGrid rest = test::readVdb(folder / "a.vdb").at("rest");
  for (const Vec3& vertex : blade.vertices) {
    const Vec3 at = (vertex - rest.origin) / rest.voxelSize;
    const Index near{static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())),
                     static_cast<int>(std::lround(at.z()))};
    test::forEachIndex({near[0] - 1, near[1] - 1, near[2] - 1}, {near[0] + 1, near[1] + 1, near[2] + 1},
                       [&](const Index& i) { EXPECT_TRUE(rest.active(i)); });
  }
}

TEST(SolidGrids, WritesMetadataOnEveryGrid) {
  const test::ScratchFolder folder;
  SolidGrids grids(icosphere(2), {.voxelSize = 0.1});
  grids.setMetadata("polestar:domain", std::string("none yet"));
  grids.addVector("rest", ValueRole::invariant, stampAll);
  grids.addVector("fiber", ValueRole::contravariant, stampAll, false);
  grids.addScalar("green", copyDistance);
  grids.setMetadata("polestar:domain", std::string("ball"));
  grids.setMetadata("polestar:harmonic_radius", 1.0 / 3);
  grids.setMetadata("polestar:charges", std::int64_t{1} << 40);
  grids.setMetadata("polestar:center", Vec3(1.5, -2, 1e6));
  grids.write(folder / "a.vdb");

  const auto file = test::readVdb(folder / "a.vdb");
  ASSERT_EQ(file.size(), 5u);
  for (const auto& [name, grid] : file) {
    SCOPED_TRACE(name);
    EXPECT_EQ(grid.creator, std::string("polestar ") + kVersion);
    EXPECT_FALSE(grid.halfFloats);
    EXPECT_EQ(grid.metadata.at("is_saved_as_half_float"), "bool false");
    EXPECT_EQ(grid.metadata.at("file_voxel_count"), "int64 " + std::to_string(grid.activeCount));
    EXPECT_EQ(grid.metadata.at("file_compression"), "string blosc + active values");
    EXPECT_EQ(grid.metadata.at("polestar:domain"), "string ball");
    EXPECT_THAT(grid.metadata.at("polestar:harmonic_radius"), StartsWith("double 0.33333"));
    EXPECT_EQ(grid.metadata.at("polestar:charges"), "int64 1099511627776");
    EXPECT_THAT(grid.metadata.at("polestar:center"), StartsWith("vec3d [1.5, -2, 1"));
    EXPECT_TRUE(grid.uniformLinear);
    EXPECT_EQ(grid.voxelSize, 0.1);
    EXPECT_EQ(grid.origin, file.at("surface").origin);
  }
  EXPECT_EQ(file.at("surface").gridClass, "level set");
  EXPECT_EQ(file.at("density").gridClass, "fog volume");
  EXPECT_EQ(file.at("rest").gridClass, "unknown");
  EXPECT_EQ(file.at("rest").valueType, "vec3s");
  EXPECT_EQ(file.at("rest").vectorType, "invariant");
  EXPECT_EQ(file.at("fiber").vectorType, "contravariant relative");
  EXPECT_EQ(file.at("fiber").activeCount, grids.insideVoxels());
  EXPECT_EQ(file.at("green").valueType, "float");
  for (const char* name : {"density", "rest", "fiber", "green"}) {
    for (const float value : file.at(name).background) EXPECT_EQ(value, 0) << name;
  }
}

// A body of the same shape near the origin, 1e6 away, or 1e-7 in size: same voxels, positions to double
// precision.
TEST(SolidGrids, SurvivesFarAndTinyModels) {
  const test::ScratchFolder folder;
  const TriMesh base = smoothStar(3);
  const auto grids = [&](double scale, const Vec3& offset, const std::string& name) {
    const TriMesh mesh = transformed(base, [&](const Vec3& v) -> Vec3 { return scale * v + offset; });
    SolidGrids result(mesh, {.voxelSize = scale / 16});
    result.addVector("rest", ValueRole::invariant, [&](const VoxelBatch& batch, std::span<Vec3f> out) {
      for (std::size_t i = 0; i < out.size(); ++i)
        out[i] = ((batch.points[i] - offset) / scale).cast<float>();
    });
    result.write(folder / name);
    return test::readVdb(folder / name);
  };
  const auto home = grids(1, Vec3::Zero(), "home.vdb");
  const Vec3 away(1e6, -1e6, 2e6);
  struct Case {
    double scale;
    Vec3 offset;
    std::string name;
    double tolerance;  // of positions in units of the body: the rounding of the mesh's own coordinates
  };
  for (const Case& c :
       {Case{1, away, "far.vdb", 1e-9}, Case{1e-7, Vec3::Zero(), "tiny.vdb", 1e-15},
        Case{1e7, Vec3::Zero(), "huge.vdb", 1e-15}, Case{1e-7, Vec3(1, 2, -1), "both.vdb", 1e-8}}) {
    SCOPED_TRACE(c.name);
    const auto other = grids(c.scale, c.offset, c.name);
    const FileGrid &a = home.at("rest"), &b = other.at("rest");
    EXPECT_TRUE(b.uniformLinear);
    EXPECT_DOUBLE_EQ(b.voxelSize, c.scale / 16);
    EXPECT_LT(((b.origin - c.offset) / c.scale - a.origin).norm(), c.tolerance);
    // Rounding may move a voxel at the very edge of the padding.
    EXPECT_NEAR(static_cast<double>(a.activeCount), static_cast<double>(b.activeCount), 4);
    const FileGrid &sa = home.at("surface"), &sb = other.at("surface");
    test::forEachIndex(a.activeMin, a.activeMax, [&](const Index& i) {
      EXPECT_NEAR(sa.value(i)[0], sb.value(i)[0] / c.scale, c.tolerance + 1e-7);
      if (!a.active(i) || !b.active(i)) return;
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(a.value(i)[k], b.value(i)[k], c.tolerance + 2e-7);
    });
  }
}

TEST(SolidGrids, WarnsOfVoxelsThatOthersRefuse) {
  Context context;
  std::string log;
  context.onLog = [&](LogLevel level, std::string_view message) {
    if (level == LogLevel::warning) log += message;
  };
  const TriMesh tiny = transformed(icosphere(2), [](const Vec3& v) -> Vec3 { return 1e-7 * v; });
  const SolidGrids small(tiny, {.voxelSize = 1e-8}, context);
  EXPECT_THAT(log, HasSubstr("Blender"));
  log.clear();
  const SolidGrids usual(icosphere(2), {.voxelSize = 0.1}, context);
  EXPECT_EQ(log, "");
}

TEST(SolidGrids, BricksShowWhatIsWritten) {
  const test::ScratchFolder folder;
  const TriMesh mesh = smoothStar(3);
  SolidGrids grids(mesh, {.voxelSize = voxelSizeFor(mesh, 30)});
  grids.addVector("rest", ValueRole::invariant, stampAll);
  grids.write(folder / "a.vdb");
  const auto file = test::readVdb(folder / "a.vdb");
  const FileGrid &rest = file.at("rest"), &surface = file.at("surface");

  std::vector<int> visits(grids.leafCount("rest"));
  std::atomic<std::size_t> ownActive{0}, differences{0};
  grids.visitBricks("rest", [&](std::size_t leaf, const SolidGrids::Brick& brick) {
    ++visits.at(leaf);
    const auto [x, y, z] = brick.origin;
    std::size_t n = 0;
    test::forEachIndex({x, y, z}, {x + 8, y + 8, z + 8}, [&](const Index& i) {
      for (int k = 0; k < 3; ++k) differences += !sameBits(brick.values[n][k], rest.value(i)[k]);
      differences += !sameBits(brick.signedDistance[n], surface.value(i)[0]);
      differences += (brick.active[n] != 0) != rest.active(i);
      ownActive += brick.active[n] && i[0] < x + 8 && i[1] < y + 8 && i[2] < z + 8;
      ++n;
    });
    EXPECT_EQ(n, brick.values.size());
  });
  EXPECT_THAT(visits, ::testing::Each(1));
  EXPECT_EQ(differences, 0u);
  EXPECT_EQ(ownActive, grids.activeVoxels()) << "the leaves' own voxels are all voxels";
}

TEST(SolidGrids, ReplacesWhatACubeLists) {
  const TriMesh mesh = smoothStar(3);
  SolidGrids grids(mesh, {.voxelSize = voxelSizeFor(mesh, 20)});
  grids.addVector("rest", ValueRole::invariant, stampAll, false);
  SolidGrids::Cube cube = grids.readCube("rest", {-3, 5, 6}, 11);
  ASSERT_EQ(cube.values.size(), 11u * 11 * 11);
  std::vector<std::size_t> held;
  for (std::size_t i = 0; i < cube.values.size(); ++i) {
    const Vec3 index(-3 + static_cast<double>(i / 121), 5 + static_cast<double>(i / 11 % 11),
                     6 + static_cast<double>(i % 11));
    EXPECT_EQ(cube.active[i] != 0, cube.signedDistance[i] < 0);
    EXPECT_EQ(cube.values[i], cube.active[i] ? stamp(grids.indexToWorld(index)) : Vec3f(Vec3f::Zero()));
    if (cube.active[i]) held.push_back(i);
  }
  ASSERT_GT(held.size(), 100u);
  ASSERT_LT(held.size(), cube.values.size());

  const std::vector<Vec3f> before = cube.values;
  for (Vec3f& value : cube.values) value += Vec3f(1, 2, 3);
  const std::vector<std::size_t> some{held[3], held[70]};
  grids.replace("rest", cube, some);
  const SolidGrids::Cube after = grids.readCube("rest", cube.lowest, cube.size);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const bool listed = i == some[0] || i == some[1];
    EXPECT_EQ(after.values[i], listed ? cube.values[i] : before[i]);
    EXPECT_EQ(after.active[i], cube.active[i]);
  }
  EXPECT_THROW(grids.readCube("surface", {0, 0, 0}, 2), Error);
}

TEST(SolidGrids, AreReadAsTheyWereWritten) {
  const test::ScratchFolder folder;
  const TriMesh mesh = transformed(smoothStar(3), [](const Vec3& v) -> Vec3 { return v + Vec3(1e4, -7, 3); });
  const GridOptions options{.voxelSize = voxelSizeFor(mesh, 30)};
  SolidGrids grids(mesh, options);
  grids.addVector("rest", ValueRole::invariant, stampAll);
  grids.setMetadata("polestar:center", Vec3(1, 2, 3));
  grids.write(folder / "map.vdb");
  const std::optional<SolidGrids> again = SolidGrids::read(folder / "map.vdb");
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->voxelSize(), grids.voxelSize());
  EXPECT_EQ(again->insideVoxels(), grids.insideVoxels());
  EXPECT_EQ(again->activeVoxels(), grids.activeVoxels());
  EXPECT_EQ(again->indexToWorld(Vec3(3, 4, 5)), grids.indexToWorld(Vec3(3, 4, 5)));

  // Filled further they are what new ones would be, to the last byte.
  const std::vector<std::string> rest{"rest"}, none;
  SolidGrids shared = again->sharing(rest), fresh = grids.sharing(rest);
  for (SolidGrids* some : {&shared, &fresh}) some->addScalar("distance", copyDistance);
  shared.write(folder / "shared.vdb");
  fresh.write(folder / "fresh.vdb");
  EXPECT_TRUE(test::bytesOf(folder / "shared.vdb") == test::bytesOf(folder / "fresh.vdb"));
  again->sharing(none).write(folder / "none.vdb");
  SolidGrids(mesh, options).write(folder / "new.vdb");
  EXPECT_TRUE(test::bytesOf(folder / "none.vdb") == test::bytesOf(folder / "new.vdb"));
  EXPECT_THROW(again->sharing({"green"}), Error);
}

TEST(SolidGrids, AreNotReadFromWhatIsNoMapOfThem) {
  const test::ScratchFolder folder;
  const TriMesh mesh = icosphere(3);
  const auto isRead = [&](const Attribute& rest, bool padded) {
    SolidGrids grids(mesh, {.voxelSize = 0.1});
    grids.add(
        {&rest, 1},
        [&](const VoxelBatch& batch, AttributeValues& values) {
          if (rest.vector) stampAll(batch, values.vectors(0));
        },
        padded);
    grids.write(folder / "some.vdb");
    return SolidGrids::read(folder / "some.vdb").has_value();
  };
  EXPECT_TRUE(isRead({.name = "rest", .vector = true}, true));
  EXPECT_FALSE(isRead({.name = "Cd", .vector = true}, true));
  EXPECT_FALSE(isRead({.name = "rest"}, true)) << "of scalars";
  EXPECT_FALSE(isRead({.name = "rest", .vector = true, .half = true}, true));
  EXPECT_FALSE(isRead({.name = "rest", .vector = true}, false)) << "without padding";
  EXPECT_THROW(SolidGrids::read(folder / "nothing.vdb"), Error);
}

TEST(SolidGrids, ThrowsWhatTheSamplerThrowsAndAddsNothing) {
  SolidGrids grids(icosphere(2), {.voxelSize = 0.1});
  struct Refusal {};
  EXPECT_THROW(grids.addVector("rest", ValueRole::invariant,
                               [](const VoxelBatch&, std::span<Vec3f>) { throw Refusal(); }),
               Refusal);
  EXPECT_EQ(errorOf([&] { grids.leafCount("rest"); }).code(), Errc::usage);
  grids.addVector("rest", ValueRole::invariant, stampAll);
  EXPECT_GT(grids.leafCount("rest"), 0u);

  Context context;
  EXPECT_EQ(errorOf([&] {
              grids.addScalar(
                  "green", [&](const VoxelBatch&, std::span<float>) { context.cancel(); }, false, context);
            }).code(),
            Errc::cancelled);
}

TEST(SolidGrids, ReportsProgressToTheEnd) {
  Context context;
  std::vector<double> fractions;
  context.onProgress = [&](std::string_view, double fraction) { fractions.push_back(fraction); };
  SolidGrids grids(icosphere(2), {.voxelSize = 0.02});
  grids.addVector("rest", ValueRole::invariant, stampAll, true, context);
  ASSERT_GT(fractions.size(), 10u);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.back(), 1);
}

TEST(SolidGrids, RefusesImpossibleRequests) {
  const TriMesh ball = icosphere(2);
  SolidGrids grids(ball, {.voxelSize = 0.1});
  for (const char* name : {"", "two words", "surface", "density"}) {
    EXPECT_EQ(errorOf([&] { grids.addScalar(name, copyDistance); }).code(), Errc::usage) << name;
  }
  for (const double size : {0.0, -1.0, std::nan(""), 0.6}) {
    EXPECT_EQ(errorOf([&] { SolidGrids(ball, {.voxelSize = size}); }).code(), Errc::usage) << size;
  }
  EXPECT_EQ(errorOf([&] { SolidGrids(ball, {.voxelSize = 0.1, .padding = -1}); }).code(), Errc::usage);
  EXPECT_EQ(errorOf([&] { SolidGrids(ball, {.voxelSize = 0.1, .halfWidth = 1}); }).code(), Errc::usage);
  EXPECT_EQ(errorOf([&] { voxelSizeFor(ball, 3); }).code(), Errc::usage);
  EXPECT_EQ(errorOf([&] { voxelSizeFor(TriMesh{}, 32); }).code(), Errc::usage);
}

// The message names a size; that size must pass, and one clearly above it must not.
TEST(SolidGrids, RefusesWhatDoesNotFitAndSaysWhatWould) {
  const TriMesh ball = icosphere(2);
  const std::size_t limit = 4'000'000;
  const Error error = errorOf([&] { SolidGrids(ball, {.voxelSize = 1e-12, .memoryLimit = limit}); });
  EXPECT_EQ(error.code(), Errc::usage);
  const std::string message = error.what();
  EXPECT_THAT(message, HasSubstr("would fit"));
  const int dim = std::stoi(message.substr(message.find(": ") + 2));
  EXPECT_GT(dim, 20) << message;
  EXPECT_LT(dim, 80) << message;
  EXPECT_NO_THROW(SolidGrids(ball, {.voxelSize = voxelSizeFor(ball, dim), .memoryLimit = limit}));
  EXPECT_THROW(SolidGrids(ball, {.voxelSize = voxelSizeFor(ball, dim + 2), .memoryLimit = limit}), Error);
  // Without a limit of the caller's, the machine's memory is one.
  EXPECT_EQ(errorOf([&] { SolidGrids(ball, {.voxelSize = 1e-6}); }).code(), Errc::usage);
}

}  // namespace
}  // namespace polestar
