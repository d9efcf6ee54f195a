// The command line itself: help, usage errors, outputs that cannot be, dry runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "polestar/core/version.h"
#include "polestar/mesh/shapes.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::vector<std::string>& commands() {
  static const std::vector<std::string> names{"check", "map",    "eval", "verify",
                                              "info",  "render", "iso",  "warp"};
  return names;
}

void expectUsageError(const std::vector<std::string>& arguments, const std::string& what) {
  const ToolRun run = runTool(arguments);
  EXPECT_EQ(run.exitCode, 2) << run.err;
  EXPECT_EQ(run.out, "");
  EXPECT_THAT(run.err, StartsWith("polestar"));
  EXPECT_THAT(run.err, HasSubstr(what));
  EXPECT_LE(std::count(run.err.begin(), run.err.end(), '\n'), 2) << run.err;
}

TEST(Usage, HelpListsTheCommandsAndExitCodes) {
  const ToolRun run = runTool({"--help"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.err, "");
  for (const std::string& command : commands()) EXPECT_THAT(run.out, HasSubstr("\n  " + command + " "));
  EXPECT_THAT(run.out, HasSubstr("5 not star-shaped"));
}

TEST(Usage, EveryHelpEndsWithAnExample) {
  for (const std::string& command : commands()) {
    SCOPED_TRACE(command);
    const ToolRun run = runTool({command, "--help"});
    EXPECT_EQ(run.exitCode, 0);
    EXPECT_EQ(run.err, "");
    const std::size_t example = run.out.find("Example:\n  polestar " + command + " ");
    ASSERT_NE(example, std::string::npos) << run.out;
    EXPECT_EQ(std::count(run.out.begin() + static_cast<std::ptrdiff_t>(example), run.out.end(), '\n'), 2)
        << run.out;
    for (const char* option :
         {"--output", "--threads", "--verbose", "--quiet", "--json", "--overwrite", "--dry-run"}) {
      EXPECT_THAT(run.out, HasSubstr(option));
    }
  }
}

TEST(Usage, VersionIsTheLibrarys) {
  const ToolRun run = runTool({"--version"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.out, std::string("polestar ") + kVersion + "\n");
}

TEST(Usage, MistakesAreNamedAndEndWith2) {
  expectUsageError({}, "--help");
  expectUsageError({"chek", "a.obj"}, "no command chek");
  expectUsageError({"check"}, "MESH is required");
  expectUsageError({"check", "a.obj", "--colour"}, "--colour");
  expectUsageError({"check", "a.obj", "b.obj"}, "b.obj");
  expectUsageError({"check", "a.obj", "-j", "0"}, "--threads");
  expectUsageError({"check", "a.obj", "-j", "many"}, "--threads");
  expectUsageError({"check", "a.obj", "-q", "-v"}, "--quiet");
  expectUsageError({"check", "a.obj", "--center", "1,2"}, "\"1,2\"");
  expectUsageError({"check", "a.obj", "--rays", "-1"}, "--rays");
  expectUsageError({"check", "-"}, "standard input");
  expectUsageError({"map", "a.obj"}, "-o OUT.vdb is missing");
  expectUsageError({"map", "a.obj", "-o", "a.pmap"}, "does not end in .vdb");
  expectUsageError({"map", "a.obj", "-o", "--overwrite"}, "looks like an option");
  expectUsageError({"map", "a.obj", "-o", "a.vdb", "--dim", "64", "--voxel", "0.1"}, "--voxel");
  expectUsageError({"map", "a.obj", "-o", "a.vdb", "--voxel", "0"}, "--voxel");
  expectUsageError({"map", "a.obj", "-o", "a.vdb", "--dim", "3"}, "--dim");
  expectUsageError({"map", "a.obj", "-o", "a.vdb", "--boundary", "square"}, "--boundary");
  expectUsageError({"map", "a.obj", "-o", "a.vdb", "--core", "hard"}, "--core");
  expectUsageError({"map", "a.obj", "-o", "a.vdb", "--solver", "magic"}, "--solver");
  expectUsageError({"map", "a.obj", "-o", "a.vdb", "--device", "gpu"}, "\"gpu\"");
  expectUsageError({"verify"}, "FILE is required");
  expectUsageError({"info"}, "FILE");
  expectUsageError({"info", "a.obj", "--devices"}, "--devices");
  expectUsageError({"eval", "a.obj"}, "--points is required");
  expectUsageError({"render", "a.pmap"}, "-o OUT.png is missing");
  expectUsageError({"render", "a.pmap", "-o", "a.jpg"}, "does not end in .png");
  expectUsageError({"render", "a.pmap", "-o", "a.png", "--cut", "w"}, "\"w\"");
  expectUsageError({"render", "a.pmap", "-o", "a.png", "--cut", "x,2"}, "");
  expectUsageError({"render", "a.pmap", "-o", "a.png", "--size", "1280"}, "\"1280\"");
  expectUsageError({"render", "a.pmap", "-o", "a.png", "--size", "0x10"}, "");
  expectUsageError({"warp", "a.vtk"}, "MAP is required");
  expectUsageError({"warp", "a.xls", "a.pmap", "-o", "b.vtk"}, "a.xls");
  expectUsageError({"warp", "a.vtk", "a.pmap"}, "-o FILE is missing");
  expectUsageError({"warp", "a.vtk", "a.pmap", "-o", "b.obj"}, "does not end in .vtk");
  expectUsageError({"warp", "a.vtk", "a.pmap", "-o", "-"}, "does not end in .vtk");
  expectUsageError({"warp", "a.obj", "a.pmap", "-o", "b.vtk"}, "does not end in .obj");
  expectUsageError({"warp", "a.obj", "a.pmap", "-o", "b.ply", "--dim", "64"}, "for grids");
  expectUsageError({"warp", "a.vdb", "a.pmap", "-o", "b.vdb", "--dim", "64", "--voxel", "1"}, "--voxel");
  expectUsageError({"warp", "a.obj", "a.pmap", "-o", "b.ply", "--snap", "-1"}, "--snap");
  expectUsageError({"warp", "a.obj", "a.pmap", "-o", "b.ply", "--rotate", "1,2"}, "--rotate");
}

TEST(Usage, MistakesAreJsonToo) {
  const ToolRun run = runTool({"check", "a.obj", "--colour", "--json"});
  EXPECT_EQ(run.exitCode, 2);
  const auto json = run.json();
  EXPECT_EQ(json["schema"], "polestar/1");
  EXPECT_EQ(json["command"], "check");
  EXPECT_EQ(json["error"]["code"], "usage");
  EXPECT_THAT(json["error"]["message"].get<std::string>(), HasSubstr("--colour"));
}

TEST(Usage, JsonAndGridsDoNotShareStandardOutput) {
  const ToolRun run = runTool({"map", "a.obj", "-o", "-", "--json"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_EQ(run.json()["error"]["code"], "usage");
}

struct OutputCase {
  std::vector<std::string> arguments;
  std::string suffix;
};

class Outputs : public ::testing::Test {
 protected:
  /// Every command that writes a file; the output's name is still to come.
  std::vector<OutputCase> writers() {
    return {{{"check", mesh_}, ".json"},     {{"info", mesh_}, ".json"},
            {{"verify", mesh_}, ".json"},    {{"eval", mesh_, "--points", points_}, ".json"},
            {{"map", mesh_}, ".vdb"},        {{"render", mesh_}, ".png"},
            {{"warp", mesh_, mesh_}, ".ply"}};
  }

  void expectRefused(OutputCase writer, const std::string& output, const std::string& what) {
    writer.arguments.insert(writer.arguments.end(), {"-o", output});
    const auto before = scratch_.names();
    const ToolRun run = runTool(writer.arguments);
    EXPECT_EQ(run.exitCode, 3) << writer.arguments[0];
    EXPECT_EQ(run.out, "");
    EXPECT_THAT(run.err, StartsWith("polestar " + writer.arguments[0] + ": "));
    EXPECT_THAT(run.err, HasSubstr(what));
    EXPECT_EQ(scratch_.names(), before);
  }

  ScratchFolder scratch_;
  std::string mesh_ = scratch_.obj("ball.obj", icosphere(2));
  std::string points_ = scratch_.file("points.txt", "0 0 0\n");
};

TEST_F(Outputs, ExistingFilesAreNotReplaced) {
  for (const OutputCase& writer : writers()) {
    const std::string output = scratch_.file("precious" + writer.suffix, "precious");
    expectRefused(writer, output, "--overwrite");
    EXPECT_EQ(readFile(output), "precious");
  }
}

TEST_F(Outputs, TheMapBesideTheGridsIsNotReplacedEither) {
  const std::string beside = scratch_.file("out.pmap", "precious");
  expectRefused({{"map", mesh_}, ""}, scratch_ / "out.vdb", "out.pmap");
  EXPECT_EQ(readFile(beside), "precious");
}

TEST_F(Outputs, DanglingLinksCountAsExisting) {
  ASSERT_EQ(symlink("nowhere", (scratch_ / "link.json").c_str()), 0);
  expectRefused(writers()[0], scratch_ / "link.json", "--overwrite");
}

TEST_F(Outputs, TheInputIsNeverReplaced) {
  const ToolRun run = runTool({"check", mesh_, "-o", mesh_, "--overwrite"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("input itself"));
  EXPECT_THAT(readFile(mesh_), StartsWith("v "));
}

TEST_F(Outputs, PlacesThatCannotBeWrittenAreFoundBeforeComputing) {
  for (const OutputCase& writer : writers()) {
    expectRefused(writer, scratch_ / ("nowhere/out" + writer.suffix), "nowhere");
    expectRefused(writer, points_ + "/out" + writer.suffix, "no folder");
    std::filesystem::create_directory(scratch_.path() / ("folder" + writer.suffix));
    expectRefused(writer, scratch_ / ("folder" + writer.suffix), "is a folder");
  }
}

TEST_F(Outputs, FoldersWithoutPermissionAreFoundBeforeComputing) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  std::filesystem::create_directory(scratch_.path() / "locked");
  chmod((scratch_ / "locked").c_str(), 0500);
  expectRefused(writers()[0], scratch_ / "locked/out.json", "Permission denied");
}

TEST_F(Outputs, DryRunsSayWhatWouldBeMadeAndMakeNothing) {
  const auto before = scratch_.names();
  ToolRun run = runTool({"map", mesh_, "-o", scratch_ / "out.vdb", "--dim", "20", "--dry-run"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("would read " + mesh_));
  EXPECT_THAT(run.out, HasSubstr("would write " + (scratch_ / "out.vdb")));
  EXPECT_THAT(run.out, HasSubstr("would write " + (scratch_ / "out.pmap")));
  EXPECT_THAT(run.out, HasSubstr("26 x 26 x 26 voxels of 0.1"))
      << "a ball of radius 1 and 3 voxels around it";

  run = runTool({"render", mesh_, "-o", scratch_ / "out.png", "--size", "64x48", "--dry-run", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const auto plan = run.json()["dry_run"];
  EXPECT_EQ(plan["writes"][0]["path"], scratch_ / "out.png");
  EXPECT_EQ(plan["writes"][0]["content"], "picture of 64 x 48 pixels");

  EXPECT_EQ(runTool({"check", scratch_ / "missing.obj", "--dry-run"}).exitCode, 3);
  EXPECT_EQ(scratch_.names(), before);
}

}  // namespace
}  // namespace polestar::testing
