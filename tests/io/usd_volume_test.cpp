// The .usda beside a .vdb: what it says, and how names that USD cannot have are told.
#include "polestar/io/usd_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polestar/core/error.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

GridInfo grid(const std::string& name, const std::string& type, const std::string& kind = "unknown",
              ValueRole role = ValueRole::invariant) {
  GridInfo info;
  info.name = name;
  info.valueType = type;
  info.gridClass = kind;
  info.role = role;
  info.activeVoxels = 1;
  info.box = {Vec3(-1, -2, -3), Vec3(1, 2, 3.5)};
  return info;
}

class UsdVolumeTest : public ::testing::Test {
 protected:
  std::string written(const UsdVolume& volume, const std::string& name = "cloud.usda") {
    writeUsdVolume(folder_ / name, volume, "made by a test");
    return test::bytesOf(folder_ / name);
  }
  test::ScratchFolder folder_;
};

TEST_F(UsdVolumeTest, NamesEveryGrid) {
  UsdVolume volume;
  volume.frames.push_back(
      {std::nullopt,
       folder_ / "sub/cloud 1.vdb",
       {grid("density", "float", "fog volume"), grid("surface", "float", "level set"), grid("Cd", "vec3s"),
        grid("vel", "vec3s", "staggered", ValueRole::contravariant), grid("my \"grid\"", "int32"),
        grid("density", "double"), grid("points", "ptdataidx32")}});
  volume.upAxis = 'Z';
  volume.metersPerUnit = 0.01;
  const std::string text = written(volume);
  EXPECT_THAT(text, ::testing::StartsWith("#usda 1.0\n(\n    defaultPrim = \"cloud\"\n"));
  EXPECT_THAT(
      text,
      AllOf(HasSubstr("upAxis = \"Z\""), HasSubstr("metersPerUnit = 0.01"),
            HasSubstr("def Volume \"cloud\"\n"), HasSubstr("float3[] extent = [(-1, -2, -3), (1, 2, 3.5)]"),
            HasSubstr("rel field:density = </cloud/density>"),
            HasSubstr("asset filePath = @./sub/cloud 1.vdb@"), HasSubstr("token fieldClass = \"levelSet\""),
            HasSubstr("token fieldClass = \"fogVolume\"")));
  EXPECT_THAT(
      text,
      AllOf(HasSubstr("token fieldDataType = \"float3\""), HasSubstr("token vectorDataRoleHint = \"Color\""),
            HasSubstr("token vectorDataRoleHint = \"Vector\""),
            HasSubstr("token fieldName = \"my \\\"grid\\\"\""), HasSubstr("def OpenVDBAsset \"my__grid_\""),
            // The second grid of that name.
            HasSubstr("def OpenVDBAsset \"density_1\""), HasSubstr("int fieldIndex = 0\n"),
            Not(HasSubstr("points")), Not(HasSubstr("timeSamples"))));
  EXPECT_EQ(folder_.entries(), 1U);
}

TEST_F(UsdVolumeTest, SequencesHaveTimeSamples) {
  UsdVolume volume;
  volume.framesPerSecond = 25;
  for (const int frame : {3, 5, 7}) {
    GridInfo density = grid("density", "float", "fog volume");
    density.box.max.x() = frame;
    volume.frames.push_back({frame, folder_ / ("melt@" + std::to_string(frame) + ".vdb"), {density}});
  }
  const std::string text = written(volume, "1 melt.usda");
  EXPECT_THAT(text,
              AllOf(HasSubstr("startTimeCode = 3\n"), HasSubstr("endTimeCode = 7\n"),
                    HasSubstr("framesPerSecond = 25\n"), HasSubstr("timeCodesPerSecond = 25\n"),
                    HasSubstr("asset filePath.timeSamples = {\n            3: @@@./melt@3.vdb@@@,\n"),
                    HasSubstr("float3[] extent.timeSamples = {\n        3: [(-1, -2, -3), (3, 2, 3.5)],\n"),
                    HasSubstr("def Volume \"_1_melt\"")));
  volume.frames[1].grids[0].name = "smoke";
  EXPECT_THROW(written(volume), Error);
  volume.frames.resize(1);
  volume.frames[0].grids = {grid("points", "ptdataidx32")};
  EXPECT_THROW(written(volume), Error);
}

}  // namespace
}  // namespace polestar
