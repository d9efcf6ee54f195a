// map --domain: cubes and polycubes from the shell, and what does not work told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polestar/mesh/shapes.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

using ::testing::HasSubstr;

class DomainTool : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<ScratchFolder>();
    mesh_ = folder_->obj("star.obj", smoothStar(3));
    made_ = runTool({"map", mesh_, "-o", *folder_ / "cube.vdb", "--domain", "cube", "--domain-axes", "0,0,0",
                     "--dim", "32", "--inverse", *folder_ / "cube-position.vdb", "--json"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  void SetUp() override { ASSERT_EQ(made_.exitCode, 0) << made_.err; }

  static ToolRun refused(std::vector<std::string> options) {
    std::vector<std::string> words{"map", mesh_, "-o", *folder_ / "never.vdb", "--dim", "16"};
    words.insert(words.end(), options.begin(), options.end());
    return runTool(words);
  }

  static inline std::unique_ptr<ScratchFolder> folder_;
  static inline std::string mesh_;
  static inline ToolRun made_;
};

TEST_F(DomainTool, SaysWhatTheDomainIs) {
  const auto json = made_.json();
  EXPECT_EQ(json["domain"]["kind"], "cube");
  EXPECT_EQ(json["domain"]["cells"], 1);
  EXPECT_EQ(json["domain"]["corners"], 8);
  EXPECT_GT(json["domain"]["overlap"].get<double>(), 0.3);
  EXPECT_EQ(json["sphere"]["kind"], "field-line");
  EXPECT_EQ(json["certificate"]["verdict"], "proved");
  EXPECT_EQ(json["inverse"]["inverted_deep"], 0);
  EXPECT_EQ(json["domain"]["distortion_by_edge_distance"].size(), 5u);
}

TEST_F(DomainTool, BothFilesAreVerified) {
  for (const char* name : {"cube.vdb", "cube.pmap"}) {
    const ToolRun run = runTool({"verify", *folder_ / name});
    EXPECT_EQ(run.exitCode, 0) << run.out << run.err;
  }
}

TEST_F(DomainTool, EvalAnswersInTheDomainToo) {
  const std::string points = folder_->file("points.txt", "0 0 0\n0.3 0.1 -0.2\n9 9 9\n");
  const auto json = runTool({"eval", *folder_ / "cube.pmap", "--points", points, "--json"}).json();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(json["domain"][0][k].get<double>(), 0, 1e-12);
  EXPECT_EQ(json["domain"][1].size(), 3u);
  EXPECT_TRUE(json["domain"][2].is_null());
}

TEST_F(DomainTool, InfoNamesTheDomain) {
  EXPECT_THAT(runTool({"info", *folder_ / "cube.pmap"}).out, HasSubstr("cube"));
  const auto json = runTool({"info", *folder_ / "cube-position.vdb", "--json"}).json();
  std::vector<std::string> names;
  for (const auto& grid : json["grids"]) {
    names.push_back(grid["name"]);
    EXPECT_EQ(grid["metadata"]["polestar:domain"], "cube");
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("surface", "density", "position"));
}

TEST_F(DomainTool, TexturesOfTheBallAreNotReadOffCubeCoordinates) {
  const auto json =
      runTool({"transfer", "soccer", *folder_ / "cube.vdb", "-o", *folder_ / "soccer.vdb", "--json"}).json();
  EXPECT_EQ(json["rest"], "computed");
}

TEST_F(DomainTool, APolycubeByHandIsUsedOrNamesItsCells) {
  const std::string good = folder_->file("good.txt", "# a plus\n-1:1 0 0\n0 -1:1 0\n");
  const ToolRun run = runTool({"map", mesh_, "-o", *folder_ / "plus.vdb", "--domain", "polycube",
                               "--polycube", good, "--dim", "24", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["domain"]["cells"], 5);
  const ToolRun apart =
      refused({"--domain", "polycube", "--polycube", folder_->file("apart.txt", "0 0 0\n2 0 0\n")});
  EXPECT_EQ(apart.exitCode, 5);
  EXPECT_THAT(apart.err, HasSubstr("2 0 0"));
  const ToolRun broken =
      refused({"--domain", "polycube", "--polycube", folder_->file("broken.txt", "0 0\n")});
  EXPECT_EQ(broken.exitCode, 3);
  EXPECT_EQ(refused({"--domain", "polycube", "--polycube", *folder_ / "none.txt"}).exitCode, 3);
}

TEST_F(DomainTool, OptionsWithoutEffectAreErrors) {
  EXPECT_EQ(refused({"--cells", "4"}).exitCode, 2);
  EXPECT_EQ(refused({"--domain", "cube", "--cells", "4"}).exitCode, 2);
  EXPECT_EQ(refused({"--domain", "cube", "--exact"}).exitCode, 2);
  EXPECT_EQ(refused({"--domain-axes", "0,0,0"}).exitCode, 2);
  EXPECT_EQ(refused({"--domain", "polycube", "--cells", "65"}).exitCode, 2);
  EXPECT_EQ(refused({"--inverse", *folder_ / "never.vdb"}).exitCode, 2);
  EXPECT_THAT(folder_->names(), ::testing::Not(::testing::Contains("never.vdb")));
}

}  // namespace
}  // namespace polestar::testing
