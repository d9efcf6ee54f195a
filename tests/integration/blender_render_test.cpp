// apps/blender/render.py: pictures, and exit codes where Blender alone would draw nothing and say 0.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_tool.h"
#include "integration/blender.h"
#include "integration/sample_vdb.h"

namespace polestar::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

testing::ToolRun render(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"/usr/bin/env",
                                 "blender",
                                 "-b",
                                 "--factory-startup",
                                 "--python-exit-code",
                                 "1",
                                 "--python",
                                 POLESTAR_BLENDER_FOLDER "/render.py",
                                 "--"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return testing::runProgram(std::move(words));
}

void writeFrame(const std::string& vdb) { writeSample(vdb, {{"density"}, {"Cd", SampleGrid::Kind::vector}}); }

TEST(BlenderRender, DrawsFramesWithTheirNumbers) {
  POLESTAR_REQUIRE_BLENDER();
  const testing::ScratchFolder folder;
  for (const char* name : {"cube_0001.vdb", "cube_0002.vdb", "cube_0004.vdb"}) writeFrame(folder / name);
  const testing::ToolRun run = render({folder / "cube_####.vdb", "-o", folder / "cube_####.exr", "--frames",
                                       "2-4x2", "--size", "32x24", "--samples", "4", "--cut", "x,0.2"});
  ASSERT_EQ(run.exitCode, 0) << run.out << run.err;
  EXPECT_THAT(folder.names(), ElementsAre("cube_0001.vdb", "cube_0002.exr", "cube_0002.vdb", "cube_0004.exr",
                                          "cube_0004.vdb"));
  for (const char* name : {"cube_0002.exr", "cube_0004.exr"}) {
    const Exr picture = readExr(folder / name);
    ASSERT_EQ(picture.width, 32);
    ASSERT_EQ(picture.height, 24);
    // Blue, as the cube is and nothing else there.
    const Vec3f middle = picture.color[picture.at(16, 12)];
    EXPECT_GT(middle.z(), 2 * middle.x());
    EXPECT_GT(middle.x(), 0);
  }
}

TEST(BlenderRender, FailsWhereThePictureWouldBeBlank) {
  POLESTAR_REQUIRE_BLENDER();
  const testing::ScratchFolder folder;
  const std::string out = folder / "out.png";
  writeFrame(folder / "cube_0001.vdb");
  writeFrame(folder / "cube_0003.vdb");
  writeSample(folder / "empty.vdb", {{"density", SampleGrid::Kind::scalar, true}});
  folder.file("there.png", "");
  const struct {
    std::vector<std::string> arguments;
    int exitCode;
    std::string message;
  } cases[] = {
      {{}, 2, "FILE"},
      {{folder / "cube_0001.vdb", "-o", out, "--cut", "w"}, 2, "no plane"},
      {{folder / "cube_0001.vdb", "-o", out, "--look", "shells"}, 3, "no rest"},
      {{folder / "empty.vdb", "-o", out, "--look", "shells"}, 3, "the grid density of"},
      {{folder / "none.vdb", "-o", out}, 3, "none.vdb: No such file"},
      {{folder / "cube_####.vdb", "-o", folder / "out_####.png", "--frames", "1-3"},
       3,
       "cube_0002.vdb: No such file"},
      {{folder / "cube_0001.vdb", "-o", folder / "none/out.png"}, 3, "cannot write"},
      {{folder / "cube_0001.vdb", "-o", folder / "there.png"}, 3, "there.png exists already"},
  };
  const std::vector<std::string> before = folder.names();
  for (const auto& [arguments, exitCode, message] : cases) {
    const testing::ToolRun run = render(arguments);
    EXPECT_EQ(run.exitCode, exitCode) << run.err;
    EXPECT_THAT(run.err, HasSubstr(message));
  }
  EXPECT_EQ(folder.names(), before);
}

}  // namespace
}  // namespace polestar::test
