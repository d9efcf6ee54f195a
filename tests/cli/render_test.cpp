// render, from a map, grids of colors and fogs to pictures.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>

#include "cli/run_tool.h"
#include "polestar/mesh/shapes.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// One ball, mapped and filled with kiwi, for all tests.
class Render : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<ScratchFolder>();
    const std::string mesh = folder_->obj("ball.obj", icosphere(2));
    ASSERT_EQ(runTool({"map", mesh, "-o", grids(), "--dim", "24"}).exitCode, 0);
    const ToolRun filled = runTool({"transfer", "kiwi", map(), "-o", colors(), "--dim", "24"});
    ASSERT_EQ(filled.exitCode, 0) << filled.err;
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string grids() { return *folder_ / "ball.vdb"; }
  static std::string map() { return *folder_ / "ball.pmap"; }
  static std::string colors() { return *folder_ / "kiwi.vdb"; }

  /// A small picture of `input`, written to `output` in the test's own folder.
  ToolRun draw(const std::string& input, const std::string& output,
               std::vector<std::string> more = {}) const {
    std::vector<std::string> words{"render", input,   "-o",        scratch_ / output,
                                   "--size", "48x36", "--samples", "2"};
    words.insert(words.end(), more.begin(), more.end());
    return runTool(words);
  }
  void expectRefused(int code, const std::string& input, const std::string& output,
                     const std::vector<std::string>& more, const std::string& what) const {
    const auto before = scratch_.names();
    const ToolRun run = draw(input, output, more);
    EXPECT_EQ(run.exitCode, code) << run.err;
    EXPECT_THAT(run.err, HasSubstr(what));
    EXPECT_EQ(scratch_.names(), before);
  }

  static std::unique_ptr<ScratchFolder> folder_;
  ScratchFolder scratch_;
};
std::unique_ptr<ScratchFolder> Render::folder_;

TEST_F(Render, TexturesComeByName) {
  const ToolRun run = draw(map(), "a.png", {"--texture", "kiwi", "--set", "locules=20", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const auto json = run.json();
  EXPECT_EQ(json["look"], "texture kiwi");
  EXPECT_EQ(json["outputs"][0], scratch_ / "a.png");
  EXPECT_EQ(json["view_transform"], "polestar");
  EXPECT_EQ(json["samples"]["per_pixel"], 2);
  EXPECT_EQ(json["samples"]["unmapped"], 0);
  EXPECT_EQ(json["rays"]["camera"], 48 * 36 * 2);
  EXPECT_GT(json["rays"]["per_second"].get<double>(), 0);
  // By default the coordinates, which look otherwise.
  EXPECT_EQ(draw(map(), "b.png").exitCode, 0);
  EXPECT_NE(readFile(scratch_ / "a.png"), readFile(scratch_ / "b.png"));
  expectRefused(2, map(), "c.png", {"--texture", "cheese"}, "kiwi");
  expectRefused(2, map(), "c.png", {"--texture", "kiwi", "--set", "locules=1e9"}, "locules");
  expectRefused(2, map(), "c.png", {"--texture", "kiwi", "--set", "locules"}, "name=value");
  expectRefused(2, map(), "c.png", {"--set", "locules=20"}, "--texture");
}

TEST_F(Render, ColorsOfGridsAreDrawnWithAndWithoutTheirMap) {
  const ToolRun run = draw(colors(), "a.png", {"--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["look"], "colors of the grid Cd");
  EXPECT_EQ(run.json()["samples"]["unmapped"], 0);
  expectRefused(2, colors(), "b.png", {"--iso-lines", "radius"}, "no grid rest");
  // Grids without colors need their map.
  fs::copy_file(grids(), scratch_ / "lonely.vdb");
  expectRefused(3, scratch_ / "lonely.vdb", "b.png", {}, "lonely.pmap");
  expectRefused(3, colors(), "b.png", {"--texture", "kiwi"}, "kiwi.pmap");
}

TEST_F(Render, AnExrIsForCompositing) {
  const ToolRun run = draw(map(), "a.exr", {"--crop", "10,8,40,30", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["view_transform"], nullptr);
  const std::string bytes = readFile(scratch_ / "a.exr");
  EXPECT_THAT(bytes, StartsWith("\x76\x2f\x31\x01"));
  for (const char* name : {"ball.x", "green", "id", "worldToCamera", "polestar:arguments"})
    EXPECT_THAT(bytes.substr(0, 4000), HasSubstr(name));
  EXPECT_EQ(draw(map(), "b.exr", {"--no-aovs"}).exitCode, 0);
  EXPECT_THAT(readFile(scratch_ / "b.exr").substr(0, 4000), ::testing::Not(HasSubstr("ball.x")));
}

TEST_F(Render, FramesTurnTheSolid) {
  const ToolRun run = draw(map(), "t.####.png", {"--frames", "1-5x2"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(scratch_.names(), ElementsAre("t.0001.png", "t.0003.png", "t.0005.png"));
  EXPECT_NE(readFile(scratch_ / "t.0001.png"), readFile(scratch_ / "t.0003.png"));
  // Each output is looked at before the first is made.
  fs::remove(scratch_ / "t.0001.png");
  expectRefused(3, map(), "t.####.png", {"--frames", "1-5x2"}, "t.0003.png");
  EXPECT_EQ(draw(map(), "t.####.png", {"--frames", "1-5x2", "--overwrite"}).exitCode, 0);
  EXPECT_EQ(draw(map(), "s_$F3.png", {"--frames", "9"}).exitCode, 0);
  EXPECT_TRUE(fs::exists(scratch_ / "s_009.png"));

  expectRefused(2, map(), "u.png", {"--frames", "1-3"}, "no place for the number");
  expectRefused(2, map(), "u.####.png", {}, "--frames");
  expectRefused(2, map(), "u.####.png", {"--frames", "3-1"}, "3-1");
}

TEST_F(Render, SequencesOfInputsAreCompleteOrNothingIsDone) {
  for (const char* name : {"in.0001.vdb", "in.0002.vdb"}) fs::copy_file(colors(), scratch_ / name);
  expectRefused(3, scratch_ / "in.####.vdb", "out.####.png", {"--frames", "1-4"}, "in.0003.vdb");
  const ToolRun run = draw(scratch_ / "in.####.vdb", "out.%02d.png", {"--frames", "1-2"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_TRUE(fs::exists(scratch_ / "out.02.png"));
  expectRefused(3, scratch_ / "in.####.vdb", "in.####.png", {"--frames", "3"}, "in.0003.vdb");
}

TEST_F(Render, FogIsMarched) {
  const ToolRun run = draw(colors(), "a.png", {"--fog", "--mean-free-path", "0.2", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["look"], "fog of the grid density in the colors of Cd");
  EXPECT_GT(run.json()["samples"]["solid"].get<int>(), 300);
  EXPECT_EQ(draw(grids(), "b.exr", {"--fog"}).exitCode, 0);
  expectRefused(2, map(), "c.png", {"--fog"}, ".vdb");
  expectRefused(2, grids(), "c.png", {"--fog", "--texture", "kiwi"}, "--texture");
  expectRefused(2, grids(), "c.png", {"--fog", "--mean-free-path", "-1"}, "mean free path");
  expectRefused(2, grids(), "c.png", {"--mean-free-path", "1"}, "--fog");
}

TEST_F(Render, ScenesThatCannotBe) {
  expectRefused(2, map(), "a.png", {"--crop", "0,0,49,36"}, "48 x 36");
  expectRefused(2, map(), "a.png", {"--crop", "1,2,3"}, "x0,y0,x1,y1");
  expectRefused(2, map(), "a.png", {"--crop", "5,5,5,9"}, "x0 < x1");
  expectRefused(2, map(), "a.png", {"--background", "mauve"}, "#rrggbb");
  expectRefused(2, map(), "a.png", {"--iso-lines", "radius,bogus"}, "bogus");
  expectRefused(2, map(), "a.png", {"--explode", "0.2", "--cut-mode", "slices"}, "--cut-mode");
  expectRefused(
      2, map(), "a.png",
      {"--explode", "0.2", "--cut", "x", "--cut", "y", "--cut", "z", "--cut", "1,1,0", "--cut", "1,0,1"},
      "at most 4 planes");
  expectRefused(2, map(), "a.png", {"--light-size", "4"}, "key light");
  expectRefused(2, map(), "a.png", {"--up", "-0.55,0.75,-0.36"}, "up");
  expectRefused(2, map(), "a.png", {"--ocio-view", "Film"}, "OCIO");
  expectRefused(2, map(), "a.exr", {"--ocio-view", "Film"}, "scene-linear");
}

TEST_F(Render, BodiesStandSideBySide) {
  const ToolRun run = draw(map(), "a.png", {"--show", "whole-solid,solid,ball", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["look"], "coordinates");
  EXPECT_EQ(run.json()["rays"]["camera"], 3 * 48 * 36 * 2);
  // Width and height in the header of a .png, big endian.
  const std::string header = readFile(scratch_ / "a.png").substr(16, 8);
  EXPECT_EQ(header, std::string("\0\0\0\x90\0\0\0\x24", 8));
  EXPECT_EQ(draw(map(), "b.exr", {"--show", "solid,ball"}).exitCode, 0);
  EXPECT_THAT(readFile(scratch_ / "b.exr").substr(0, 4000), ::testing::Not(HasSubstr("ball.x")));
  expectRefused(2, map(), "c.png", {"--show", "cube"}, "whole-domain");
  expectRefused(2, map(), "c.png", {"--show", "solid,ball", "--crop", "0,0,9,9"}, "--crop");
  expectRefused(2, grids(), "c.png", {"--fog", "--show", "solid"}, "--show");
}

TEST_F(Render, WhatGoesByALatticeIsRefusedWhereTheMapHasNone) {
  expectRefused(2, map(), "a.png", {"--texture", "lattice"}, "in the ball");
  expectRefused(2, map(), "a.png", {"--iso-lines", "lattice"}, "in the ball");
  expectRefused(2, map(), "a.png", {"--show", "solid,domain"}, "in the ball");
  expectRefused(2, colors(), "a.png", {"--iso-lines", "lattice"}, "--texture");
  expectRefused(2, map(), "a.png", {"--texture", "lattice", "--set", "divisions=2"}, "odd");
  expectRefused(2, map(), "a.png", {"--texture", "lattice", "--set", "size=3"}, "divisions");
}

TEST_F(Render, ABrokenOpenColorIoConfigurationIsAnError) {
  const ToolRun run =
      runTool({"render", map(), "-o", scratch_ / "a.png", "--size", "16x16", "--samples", "1"},
              {.environment = {{"OCIO", scratch_ / "missing.ocio"}}});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("missing.ocio"));
  const ToolRun own =
      runTool({"render", map(), "-o", scratch_ / "a.png", "--size", "16x16", "--samples", "1", "--no-ocio"},
              {.environment = {{"OCIO", scratch_ / "missing.ocio"}}});
  EXPECT_EQ(own.exitCode, 0) << own.err;
}

TEST_F(Render, DryRunsCountBytesAndFrames) {
  const ToolRun run = draw(map(), "a.####.exr", {"--frames", "1-3", "--dry-run", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const auto plan = run.json()["dry_run"];
  EXPECT_EQ(plan["frames"], 3);
  EXPECT_NEAR(plan["megapixels"].get<double>(), 48 * 36 * 1e-6, 1e-12);
  ASSERT_EQ(plan["writes"].size(), 3U);
  EXPECT_EQ(plan["writes"][2]["path"], scratch_ / "a.0003.exr");
  EXPECT_TRUE(scratch_.names().empty());
  EXPECT_EQ(draw(map(), "a.0003.exr").exitCode, 0);
  EXPECT_LE(fs::file_size(scratch_ / "a.0003.exr"), plan["writes"][2]["bytes"].get<std::uint64_t>());
}

TEST_F(Render, TheSameBytesForAnyNumberOfThreads) {
  std::vector<std::string> files;
  for (const char* threads : {"1", "3"}) {
    const ScratchFolder scratch;
    const ToolRun run =
        runTool({"render", map(), "-o", "a.exr", "--size", "70x50", "--samples", "3", "--explode", "0.3"},
                {.folder = scratch.path(), .environment = {{"SLURM_CPUS_PER_TASK", threads}}});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    files.push_back(readFile(scratch / "a.exr"));
  }
  EXPECT_TRUE(files[0] == files[1]);
}

TEST_F(Render, InterruptedSequencesKeepFinishedFramesAndSayHowMany) {
  const ToolRun run = runTool({"render", map(), "-o", scratch_ / "a.####.png", "--frames", "1-400", "--size",
                               "640x480", "--samples", "16"},
                              {.interruptAfter = std::chrono::milliseconds(2500)});
  EXPECT_EQ(run.exitCode, 130);
  for (const std::string& name : scratch_.names())
    EXPECT_THAT(name, AllOf(StartsWith("a."), HasSubstr(".png")));
  const std::size_t finished = scratch_.names().size();
  EXPECT_LT(finished, 400U);
  EXPECT_THAT(run.err,
              HasSubstr(finished == 0 ? "nothing was written" : std::to_string(finished) + " finished"));
}

}  // namespace
}  // namespace polestar::testing
