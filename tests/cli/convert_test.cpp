// polestar convert: meshes, grids and slices into one another and back, through files, streams and sequences;
// what other programs rewrote; and what is refused, with nothing left behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <memory>

#include "mesh/bodies.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/edge_pairs.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"
#include "polestar/mesh/write_mesh.h"
#include "polestar/vdb/grid_set.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> gridNames(const fs::path& vdb) {
  std::vector<std::string> names;
  for (const GridInfo& grid : readGridInfo(vdb)) names.push_back(grid.name);
  return names;
}

std::map<std::string, std::string> metadataOf(const fs::path& vdb, std::size_t grid = 0) {
  const auto list = readGridInfo(vdb).at(grid).metadata;
  return {list.begin(), list.end()};
}

/// As a program does that knows nothing of polestar: file metadata gone, grids in another order, Cd renamed.
void rewriteElsewhere(const fs::path& from, const fs::path& to) {
  openvdb::initialize();
  openvdb::io::File in(from.string());
  in.open();
  const openvdb::GridPtrVecPtr grids = in.getGrids();
  openvdb::GridPtrVec turned(grids->rbegin(), grids->rend());
  for (const auto& grid : turned) {
    if (grid->getName() == "Cd") grid->setName("color");
  }
  openvdb::io::File(to.string()).write(turned);
}

class Convert : public ::testing::Test {
 protected:
  std::string body(const std::string& name, const TriMesh& mesh) const {
    writeMesh(folder_ / name, mesh);
    return folder_ / name;
  }
  ToolRun run(std::vector<std::string> arguments, const ToolSettings& settings = {}) const {
    arguments.insert(arguments.begin(), "convert");
    const ToolRun result = runTool(arguments, settings);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return result;
  }
  /// A refusal leaves nothing behind.
  void expectRefused(std::vector<std::string> arguments, int code,
                     const ::testing::Matcher<std::string>& message) {
    const std::vector<std::string> before = folder_.names();
    arguments.insert(arguments.begin(), "convert");
    const ToolRun result = runTool(arguments);
    EXPECT_EQ(result.exitCode, code) << result.err;
    EXPECT_THAT(result.err, message);
    EXPECT_EQ(folder_.names(), before);
  }

  ScratchFolder folder_;
};

TEST_F(Convert, AMeshToGridsAndBack) {
  // A ring has a handle, and is no star.
  const TriMesh ring = torus();
  const std::string mesh = body("ring.ply", ring);
  const double volume = volumeProperties(ring).volume;
  for (const char* exact : {"", "--exact"}) {
    std::vector<std::string> there{mesh, "-o", folder_ / "ring.vdb", "--dim", "80", "--overwrite", "--json"};
    if (*exact) there.push_back(exact);
    const nlohmann::json json = run(there).json();
    EXPECT_EQ(json["files"][0]["grids"].size(), 2U);
    EXPECT_THAT(gridNames(folder_ / "ring.vdb"), ElementsAre("surface", "density"));
    EXPECT_EQ(metadataOf(folder_ / "ring.vdb").at("polestar:source"), "ring.ply");
    for (const char* grid : {"surface", "density"}) {
      run({folder_ / "ring.vdb", "--pick", grid, "-o", folder_ / "back.off", "--overwrite", "-q"});
      const TriMesh back = readMesh(folder_ / "back.off").mesh;
      EXPECT_TRUE(edgesPair(back));
      EXPECT_EQ(inspectSurface(back).euler, 0);
      EXPECT_NEAR(volumeProperties(back).volume, volume, 0.01 * volume) << grid;
    }
  }
  run({folder_ / "ring.vdb", "-o", folder_ / "fewer.stl", "--adaptivity", "0.1", "-q"});
  const TriMesh fewer = readMesh(folder_ / "fewer.stl").mesh;
  EXPECT_LT(fewer.triangles.size(), readMesh(folder_ / "back.off").mesh.triangles.size() / 2);
  EXPECT_NEAR(volumeProperties(fewer).volume, volume, 0.02 * volume);
  // A level set half a unit out.
  run({folder_ / "ring.vdb", "-o", folder_ / "thick.obj", "--iso", "0.1", "-q"});
  EXPECT_GT(volumeProperties(readMesh(folder_ / "thick.obj").mesh).volume, 1.1 * volume);
}

TEST_F(Convert, CavitiesStay) {
  TriMesh hollow = icosphere(4);
  const auto first = static_cast<std::int32_t>(hollow.vertices.size());
  for (const Vec3& v : icosphere(4).vertices) hollow.vertices.push_back(0.5 * v);
  for (const Triangle& t : icosphere(4).triangles)
    hollow.triangles.push_back({t[0] + first, t[2] + first, t[1] + first});
  const double volume = volumeProperties(hollow).volume;
  const ToolRun there = run({body("hollow.obj", hollow), "-o", folder_ / "hollow.vdb", "--dim", "50", "-v"});
  EXPECT_THAT(there.err, HasSubstr("cavities"));
  run({folder_ / "hollow.vdb", "--voxel", "0.06", "-o", folder_ / "coarse.vdb"});
  run({folder_ / "coarse.vdb", "-o", folder_ / "back.ply", "-q"});
  const TriMesh back = readMesh(folder_ / "back.ply").mesh;
  EXPECT_EQ(inspectSurface(back).components, 2);
  EXPECT_NEAR(volumeProperties(back).volume, volume, 0.01 * volume);
}

TEST_F(Convert, MeshesKeepTheirOrder) {
  const TriMesh star = smoothStar(2);
  std::string last = body("0.obj", star);
  for (const char* name : {"1.ply", "2.off", "3.obj"}) {
    run({last, "-o", folder_ / name});
    last = folder_ / name;
  }
  const TriMesh same = readMesh(last).mesh;
  EXPECT_EQ(same.triangles, star.triangles);
  EXPECT_EQ(same.vertices, star.vertices);
  run({last, "-o", folder_ / "up.obj", "--up", "z"});
  const TriMesh up = readMesh(folder_ / "up.obj").mesh;
  for (std::size_t i = 0; i < star.vertices.size(); ++i) {
    const Vec3& v = star.vertices[i];
    EXPECT_EQ(up.vertices[i], Vec3(v.x(), -v.z(), v.y()));
  }
  run({last, "-o", folder_ / "soup.stl"});
  run({folder_ / "soup.stl", "-o", folder_ / "soup.obj"});
  EXPECT_EQ(readMesh(folder_ / "soup.obj").mesh.vertices.size(), 3 * star.triangles.size());
  run({folder_ / "soup.stl", "-o", folder_ / "welded.obj", "--repair"});
  EXPECT_EQ(readMesh(folder_ / "welded.obj").mesh.vertices.size(), star.vertices.size());
}

TEST_F(Convert, StandardStreams) {
  const std::string mesh = body("ball.off", icosphere(3));
  const ToolRun vdb = run({"-", "--from", "off", "-o", "-", "--dim", "20"}, {.input = readFile(mesh)});
  ASSERT_TRUE(vdb.out.starts_with(" BDV"));
  const ToolRun thinner = run({"-", "-o", "-", "--drop", "density", "-q"}, {.input = vdb.out});
  folder_.file("thin.vdb", thinner.out);
  EXPECT_THAT(gridNames(folder_ / "thin.vdb"), ElementsAre("surface"));
  const ToolRun obj = run({"-", "-o", "-", "--to", "obj", "-q"}, {.input = thinner.out});
  folder_.file("ball.obj", obj.out);
  EXPECT_NEAR(volumeProperties(readMesh(folder_ / "ball.obj").mesh).volume, 4.13, 0.06);
  // What came through a pipe has no offsets; cut short it is refused.
  EXPECT_EQ(runTool({"convert", "-", "-o", "-"}, {.input = vdb.out.substr(0, vdb.out.size() / 2)}).exitCode,
            3);
  EXPECT_EQ(runTool({"convert", "-", "-o", "-"}, {.input = ""}).exitCode, 3);
}

TEST_F(Convert, GridsAreEditedOnTheWay) {
  SolidGrids made(smoothStar(3), {.voxelSize = 0.1});
  const auto points = [](const VoxelBatch& batch, std::span<Vec3f> values) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = batch.points[i].cast<float>();
  };
  made.addVector("rest", ValueRole::invariant, points);
  made.addVector("Cd", ValueRole::invariant, points);
  made.setMetadata("polestar:center", Vec3(0, 0.25, 0.5));
  made.write(folder_ / "in.vdb");
  const ToolRun result =
      run({folder_ / "in.vdb", "-o", folder_ / "out.vdb", "--drop", "density", "--rename", "Cd=color",
           "--half", "--up", "z", "--prune", "--compression", "zip", "--json"});
  EXPECT_THAT(result.err, HasSubstr("rest: coordinates"));
  EXPECT_THAT(gridNames(folder_ / "out.vdb"), ElementsAre("surface", "rest", "color"));
  EXPECT_EQ(metadataOf(folder_ / "out.vdb").at("polestar:center"), "[0, -0.5, 0.25]");
  EXPECT_THAT(metadataOf(folder_ / "out.vdb").at("polestar:converted"), HasSubstr("--rename Cd=color"));
  EXPECT_EQ(metadataOf(folder_ / "out.vdb", 2).at("is_saved_as_half_float"), "true");
  run({folder_ / "in.vdb", "-o", folder_ / "fine.vdb", "--voxel", "0.05", "--as", "density", "--pick",
       "surface,rest"});
  EXPECT_THAT(gridNames(folder_ / "fine.vdb"), ElementsAre("density", "rest"));
  EXPECT_NEAR(readGridInfo(folder_ / "fine.vdb")[0].voxelSize, 0.05, 1e-12);
}

TEST_F(Convert, SequencesAndSlices) {
  for (int frame = 1; frame <= 3; ++frame) {
    body("in." + std::to_string(frame) + ".obj",
         transformed(icosphere(2), [&](const Vec3& v) -> Vec3 { return frame * v; }));
  }
  const nlohmann::json json = run({folder_ / "in.#.obj", "--frames", "1-3", "-o", folder_ / "out_####.vdb",
                                   "--voxel", "0.2", "--json"})
                                  .json();
  EXPECT_EQ(json["outputs"].size(), 3U);
  EXPECT_EQ(json["files"][2]["input"], folder_ / "in.3.obj");
  run({folder_ / "out_####.vdb", "--frames", "1-3", "-o", folder_ / "out.usda", "--up", "z", "--fps", "25"});
  EXPECT_THAT(
      readFile(folder_ / "out.usda"),
      AllOf(HasSubstr("2: @./out_0002.vdb@"), HasSubstr("endTimeCode = 3"), HasSubstr("upAxis = \"Z\""),
            HasSubstr("framesPerSecond = 25"), HasSubstr("rel field:density")));
  expectRefused({folder_ / "in.#.obj", "--frames", "2-5", "-o", folder_ / "no_####.vdb"}, 3,
                AllOf(HasSubstr("in.4.obj"), HasSubstr("2 of 4")));

  const nlohmann::json slices =
      run({folder_ / "out_0001.vdb", "--pick", "density", "-o", folder_ / "s.##.tif", "--json"}).json();
  const std::size_t count = slices["files"][0]["slices"]["count"];
  EXPECT_EQ(slices["outputs"].size(), count);
  EXPECT_GE(count, 10U);
  const auto joined = [](const nlohmann::json& v) {
    return std::to_string(v[0].get<double>()) + "," + std::to_string(v[1].get<double>()) + "," +
           std::to_string(v[2].get<double>());
  };
  run({folder_ / "s.##.tif", "-o", folder_ / "back.vdb", "--slice-voxel",
       joined(slices["files"][0]["slices"]["voxel"]),
       "--slice-origin=" + joined(slices["files"][0]["slices"]["origin"])});
  EXPECT_THAT(gridNames(folder_ / "back.vdb"), ElementsAre("Cd"));
  fs::remove(folder_ / "s.05.tif");
  expectRefused({folder_ / "s.##.tif", "-o", folder_ / "gap.vdb"}, 3,
                AllOf(HasSubstr("missing"), HasSubstr("5")));
  expectRefused({folder_ / "out_0001.vdb", "--pick", "density", "-o", folder_ / "s.##.tif"}, 3,
                HasSubstr("exists already"));
}

TEST_F(Convert, OtherCommandsReadGridsAsMeshes) {
  run({body("star.obj", smoothStar(3)), "-o", folder_ / "star.vdb", "--dim", "20"});
  const nlohmann::json checked = runTool({"check", folder_ / "star.vdb", "--json"}).json();
  EXPECT_EQ(checked["star"], true);
  run({folder_ / "star.vdb", "--as", "density", "--rename", "density=smoke", "-o", folder_ / "fog.vdb"});
  const ToolRun mapped =
      runTool({"map", folder_ / "fog.vdb", "-o", folder_ / "mapped.vdb", "--dim", "24", "--json"});
  ASSERT_EQ(mapped.exitCode, 0) << mapped.err;
  EXPECT_EQ(mapped.json()["certificate"]["verdict"], "proved");
  // A level set without a map is a target; one whose .pmap lies beside it has a map already.
  const ToolRun filled =
      runTool({"transfer", "kiwi", folder_ / "star.vdb", "-o", folder_ / "kiwi.vdb", "--dim", "24", "-v"});
  ASSERT_EQ(filled.exitCode, 0) << filled.err;
  EXPECT_THAT(filled.err, HasSubstr("its own surface gets one"));
  EXPECT_THAT(runTool({"check", folder_ / "mapped.vdb"}).err, HasSubstr("has a map already"));

  // Written elsewhere under the same name, the grids are still known by what they say of themselves.
  const ToolRun colored = runTool(
      {"transfer", "kiwi", folder_ / "mapped.pmap", "-o", folder_ / "colored.vdb", "--rest", "--dim", "24"});
  ASSERT_EQ(colored.exitCode, 0) << colored.err;
  rewriteElsewhere(folder_ / "mapped.vdb", folder_ / "moved.vdb");
  fs::rename(folder_ / "moved.vdb", folder_ / "mapped.vdb");
  EXPECT_EQ(runTool({"verify", folder_ / "mapped.vdb"}).exitCode, 0);
  EXPECT_THAT(runTool({"info", folder_ / "mapped.vdb"}).out, HasSubstr("polestar:map_hash"));
  const ToolRun again =
      runTool({"transfer", "orange", folder_ / "mapped.vdb", "-o", folder_ / "orange.vdb", "-v"});
  EXPECT_EQ(again.exitCode, 0) << again.err;
  EXPECT_EQ(again.err.find("gets"), std::string::npos) << again.err;
  rewriteElsewhere(folder_ / "colored.vdb", folder_ / "houdini.vdb");
  EXPECT_EQ(runTool({"transfer", folder_ / "houdini.vdb", folder_ / "mapped.pmap", "--source",
                     folder_ / "mapped.vdb", "--grids", "color", "-o", folder_ / "carried.vdb"})
                .exitCode,
            0);
  // Repacked by convert it still holds; turned, it is no picture of the map any more.
  run({folder_ / "mapped.vdb", "-o", folder_ / "packed.vdb", "--compression", "none"});
  EXPECT_EQ(runTool({"verify", folder_ / "packed.vdb"}).exitCode, 0);
  run({folder_ / "mapped.vdb", "-o", folder_ / "turned.vdb", "--up", "z"});
  EXPECT_FALSE(metadataOf(folder_ / "turned.vdb").contains("polestar:map_hash"));
  EXPECT_EQ(runTool({"verify", folder_ / "turned.vdb"}).exitCode, 0);
}

TEST_F(Convert, RefusesWithReasons) {
  const std::string ball = body("ball.obj", icosphere(3)), out = folder_ / "out.vdb";
  TriMesh open = icosphere(3);
  open.triangles.resize(open.triangles.size() - 3);
  const std::string holed = body("open.obj", open);
  expectRefused({holed, "-o", out}, 4, AllOf(HasSubstr("open"), HasSubstr("1 hole"), HasSubstr("close")));
  expectRefused({folder_ / "none.obj", "-o", out}, 3, HasSubstr("none.obj"));
  expectRefused({ball}, 2, HasSubstr("-o FILE"));
  expectRefused({ball, "-o", folder_ / "out.xyz"}, 2, HasSubstr(".obj .ply .stl .off"));
  expectRefused({folder_ / "in.abc", "-o", out}, 2, HasSubstr("--from"));
  expectRefused({ball, "-o", folder_ / "nowhere/out.vdb"}, 3, HasSubstr("no folder"));
  expectRefused({ball, "-o", folder_ / "slice.png"}, 2, HasSubstr("slice.####.png"));
  expectRefused({ball, "-o", folder_ / "out.usda"}, 2, HasSubstr("names .vdb files"));
  expectRefused({ball, "-o", out, "--adaptivity", "0.5"}, 2, HasSubstr("--adaptivity has no use"));
  expectRefused({ball, "-o", folder_ / "out.off", "--voxel", "0.1"}, 2, HasSubstr("--voxel has no use"));
  expectRefused({ball, "-o", out, "--as", "smoke"}, 2, HasSubstr("surface, density"));
  expectRefused({ball, "-o", out, "--rename", "surface"}, 2, HasSubstr("old=new"));
  expectRefused({folder_ / "ball.####.obj", "-o", folder_ / "o.####.vdb"}, 2, HasSubstr("--frames"));
  run({ball, "-o", folder_ / "ball.vdb", "--dim", "16"});
  const std::string grids = folder_ / "ball.vdb";
  expectRefused({grids, "-o", grids, "--overwrite"}, 3, HasSubstr("is the input itself"));
  expectRefused({grids, "-o", out, "--pick", "heat"}, 2, HasSubstr("surface, density"));
  expectRefused({grids, "-o", folder_ / "out.obj", "--iso", "50"}, 3, HasSubstr("has no surface"));
  folder_.file("cut.vdb", readFile(grids).substr(0, 1500));
  expectRefused({folder_ / "cut.vdb", "-o", out}, 3, HasSubstr("cut.vdb"));
  folder_.file("text.vdb", "no grids");
  expectRefused({folder_ / "text.vdb", "-o", out}, 3, HasSubstr("not a .vdb"));

  openvdb::initialize();
  const auto write = [&](const std::string& name, const openvdb::GridBase::Ptr& grid) {
    openvdb::io::File((folder_ / name)).write({grid});
    return folder_ / name;
  };
  const auto heat = openvdb::FloatGrid::create();
  heat->setName("heat");
  heat->tree().setValue({1, 2, 3}, 1);
  const std::string hot = write("heat.vdb", heat);
  expectRefused({hot, "-o", folder_ / "out.obj"}, 3, HasSubstr("no level set and no fog"));
  expectRefused({hot, "-o", out, "--as", "surface"}, 3, HasSubstr("heat"));
  EXPECT_EQ(runTool({"check", hot}).exitCode, 3);
  const auto fog = openvdb::FloatGrid::create();
  fog->setName("density");
  fog->tree().setValue({1, 2, 3}, std::numeric_limits<float>::quiet_NaN());
  expectRefused({write("nan.vdb", fog), "-o", folder_ / "out.obj"}, 3, HasSubstr("no number, at 1 2 3"));
}

}  // namespace
}  // namespace polestar::testing
