// polestar info on meshes and grids.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "run_tool.h"
#include "support/opencl.h"

namespace polestar::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Info : public ::testing::Test {
 protected:
  std::string vdb(const std::string& name) const {
    SolidGrids grids(icosphere(3), {.voxelSize = 0.1});
    grids.setMetadata("polestar:center", Vec3(1, 2, 3));
    grids.setMetadata("polestar:domain", std::string("ball"));
    grids.write(scratch_.path() / name);
    return scratch_ / name;
  }
  ScratchFolder scratch_;
};

TEST_F(Info, MeshesHaveCountsAndABox) {
  const std::string mesh = scratch_.obj("cube.obj", cube(2));
  const auto json = runTool({"info", mesh, "--json"}).json();
  EXPECT_EQ(json["command"], "info");
  EXPECT_EQ(json["file"]["format"], "obj");
  EXPECT_EQ(json["file"]["bytes"], std::filesystem::file_size(mesh));
  EXPECT_EQ(json["mesh"]["vertices"], 26);
  EXPECT_EQ(json["mesh"]["triangles"], 48);
  EXPECT_EQ(json["mesh"]["box"]["min"], nlohmann::json::array({-1, -1, -1}));
  EXPECT_EQ(json["mesh"]["box"]["max"], nlohmann::json::array({1, 1, 1}));
  EXPECT_NEAR(json["mesh"]["area"].get<double>(), 24, 1e-12);
  EXPECT_THAT(runTool({"info", mesh}).out,
              AllOf(StartsWith("cube.obj: mesh, obj, "), HasSubstr("26 vertices")));
}

TEST_F(Info, GridsAreListedWithTheirMetadata) {
  const std::string file = vdb("ball.vdb");
  const ToolRun run = runTool({"info", file, "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const auto json = run.json();
  std::vector<std::string> names;
  for (const auto& grid : json["grids"]) {
    names.push_back(grid["name"]);
    EXPECT_NEAR(grid["voxel_size"].get<double>(), 0.1, 1e-12);
    EXPECT_GT(grid["active_voxels"].get<int>(), 1000);
    EXPECT_EQ(grid["metadata"]["polestar:domain"], "ball");
  }
  std::sort(names.begin(), names.end());
  EXPECT_THAT(names, ElementsAre("density", "surface"));
}

TEST_F(Info, SharedMetadataAppearsOnce) {
  const ToolRun run = runTool({"info", vdb("ball.vdb")});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, StartsWith("ball.vdb: 2 grids, "));
  const std::size_t first = run.out.find("polestar:domain");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(run.out.find("polestar:domain", first + 1), std::string::npos) << run.out;
}

TEST_F(Info, GridsAreRecognizedByContent) {
  const auto json = runTool({"info", vdb("ball.bin"), "--json"}).json();
  EXPECT_EQ(json["file"]["format"], "vdb");
}

TEST_F(Info, DamagedGridsEndWith3) {
  const std::string whole = readFile(vdb("ball.vdb"));
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{3}, std::size_t{40}, whole.size() / 2, whole.size() - 1}) {
    SCOPED_TRACE(size);
    const std::string file = scratch_.file("damaged.vdb", whole.substr(0, size));
    const ToolRun run = runTool({"info", file});
    EXPECT_EQ(run.exitCode, 3) << run.err;
    EXPECT_THAT(run.err, AllOf(StartsWith("polestar info: "), HasSubstr("damaged.vdb")));
  }
}

TEST_F(Info, DevicesAreListedAsTheOptionNamesThem) {
  const auto& devices = openClDevices().devices;
  const ToolRun run = runTool({"info", "--devices", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const auto json = run.json();
  ASSERT_EQ(json["devices"].size(), devices.size());
  for (std::size_t i = 0; i < devices.size(); ++i) {
    EXPECT_EQ(json["devices"][i]["device"], "opencl:" + std::to_string(i));
    EXPECT_EQ(json["devices"][i]["name"], devices[i].name);
    EXPECT_EQ(json["devices"][i]["double_precision"], devices[i].doublePrecision);
    EXPECT_THAT(runTool({"info", "--devices"}).out, HasSubstr(devices[i].name));
  }
}

TEST_F(Info, WithoutDevicesTheReasonIsGiven) {
  const ToolSettings none{.environment = {{"OCL_ICD_VENDORS", "/nowhere"}}};
  if (!runTool({"info", "--devices", "--json"}, none).json()["devices"].empty())
    GTEST_SKIP() << "this OpenCL loader finds its drivers otherwise";
  EXPECT_THAT(runTool({"info", "--devices"}, none).out, StartsWith("no OpenCL device: "));
  EXPECT_NE(runTool({"info", "--devices", "--json"}, none).json()["reason"], "");
}

TEST_F(Info, MissingFilesAndFoldersEndWith3) {
  for (const std::string& path : {scratch_ / "missing.vdb", scratch_ / "missing", scratch_.path().string()}) {
    const ToolRun run = runTool({"info", path});
    EXPECT_EQ(run.exitCode, 3) << path;
    EXPECT_THAT(run.err, HasSubstr(path));
  }
}

}  // namespace
}  // namespace polestar::testing
