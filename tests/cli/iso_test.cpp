// polestar iso: iso-surfaces and iso-curves as files, and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// One map for the whole suite.
class Iso : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    maps_ = std::make_unique<ScratchFolder>();
    made_ = runTool({"map", maps_->obj("star.obj", smoothStar(3)), "-o", *maps_ / "star.vdb", "--dim", "24"});
  }
  static void TearDownTestSuite() { maps_.reset(); }
  void SetUp() override { ASSERT_EQ(made_.exitCode, 0) << made_.err; }
  static std::string star() { return *maps_ / "star.pmap"; }

  static inline std::unique_ptr<ScratchFolder> maps_;
  static inline ToolRun made_;
  ScratchFolder scratch_;
};

TEST_F(Iso, LevelsAndLinesGoToEveryFormat) {
  for (const char* name : {"iso.vtp", "iso.obj", "iso.ply"}) {
    SCOPED_TRACE(name);
    const ToolRun run = runTool({"iso", star(), "-o", scratch_ / name, "--levels", "0.5,1", "--lines", "7",
                                 "--graticule", "45", "--sheets", "1", "--json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto json = run.json();
    EXPECT_EQ(json["levels"], (std::vector<double>{0.5, 1}));
    EXPECT_EQ(json["parts"].size(), 6u);
    EXPECT_EQ(json["parts"][0]["name"], "level_0.5");
    EXPECT_EQ(json["parts"][4], (nlohmann::json{{"name", "field_lines"}, {"faces", 0}, {"curves", 7}}));
    EXPECT_EQ(json["outputs"][0], scratch_ / name);
  }
  // One level alone is a mesh as any other: closed, and of this program's own kind.
  ASSERT_EQ(runTool({"iso", star(), "-o", scratch_ / "shell.obj", "--levels", "0.5"}).exitCode, 0);
  EXPECT_TRUE(inspectSurface(readMesh(scratch_ / "shell.obj").mesh).valid);
  const ToolRun check = runTool({"check", scratch_ / "shell.obj"});
  EXPECT_EQ(check.exitCode, 0) << check.err;
}

TEST_F(Iso, AWholeNumberIsHowManyLevels) {
  const auto json = runTool({"iso", star(), "-o", scratch_ / "a.obj", "--levels", "4", "--json"}).json();
  EXPECT_EQ(json["levels"], (std::vector<double>{0.25, 0.5, 0.75, 1}));
  const auto byDefault = runTool({"iso", *maps_ / "star.vdb", "-o", scratch_ / "b.obj", "--json"}).json();
  EXPECT_EQ(byDefault["levels"].size(), 5u);
  const auto lines = runTool({"iso", star(), "-o", scratch_ / "c.obj", "--lines", "5", "--json"}).json();
  EXPECT_EQ(lines["levels"].size(), 0u);
  const std::string obj = readFile(scratch_ / "c.obj");
  std::size_t polylines = 0;
  for (std::size_t at = obj.find("\nl "); at != std::string::npos; at = obj.find("\nl ", at + 1)) ++polylines;
  EXPECT_EQ(polylines, 5u);
  EXPECT_EQ(obj.find("\nf "), std::string::npos);
}

TEST_F(Iso, ADryRunWritesNothing) {
  const ToolRun run = runTool({"iso", star(), "-o", scratch_ / "a.vtp", "--lines", "5", "--dry-run"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("a.vtp"), HasSubstr("5 lines")));
  EXPECT_TRUE(scratch_.names().empty());
}

TEST_F(Iso, MistakesAreNamed) {
  const auto refused = [&](std::vector<std::string> words, int code, const std::string& what) {
    words.insert(words.begin(), "iso");
    const ToolRun run = runTool(words);
    EXPECT_EQ(run.exitCode, code) << run.err;
    EXPECT_THAT(run.err, HasSubstr(what));
  };
  refused({star()}, 2, "-o OUT.vtp is missing");
  refused({star(), "-o", scratch_ / "a.stl"}, 2, "does not end in .vtp");
  refused({star(), "-o", scratch_ / "a.vtp", "--levels", "0.5,1.5"}, 2, "up to 1");
  refused({star(), "-o", scratch_ / "a.vtp", "--levels", "2.5"}, 2, "\"2.5\"");
  refused({star(), "-o", scratch_ / "a.vtp", "--lines", "-3"}, 2, "--lines");
  refused({scratch_ / "no.pmap", "-o", scratch_ / "a.vtp"}, 3, "no.pmap");
  const std::string there = scratch_.file("there.vtp", "");
  refused({star(), "-o", there}, 3, "there.vtp");
  EXPECT_EQ(runTool({"iso", star(), "-o", there, "--overwrite"}).exitCode, 0);
}

}  // namespace
}  // namespace polestar::testing
