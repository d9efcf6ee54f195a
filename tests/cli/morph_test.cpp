// polestar morph: sequences of grids and surfaces, parts of shots, and what is refused before anything is
// made.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Two maps are made once for the whole suite; nothing here writes to them.
class Morph : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    maps_ = std::make_unique<ScratchFolder>();
    made_ = runTool({"map", maps_->obj("star.obj", smoothStar(3)), "-o", *maps_ / "star.vdb", "--dim", "24"});
    madeBall_ =
        runTool({"map", maps_->obj("ball.obj", icosphere(3)), "-o", *maps_ / "ball.vdb", "--dim", "24"});
  }
  static void TearDownTestSuite() { maps_.reset(); }
  void SetUp() override {
    ASSERT_EQ(made_.exitCode, 0) << made_.err;
    ASSERT_EQ(madeBall_.exitCode, 0) << madeBall_.err;
  }
  static std::string star() { return *maps_ / "star.vdb"; }
  static std::string ball() { return *maps_ / "ball.pmap"; }

  /// morph of star and ball at 24 voxels, with more arguments.
  ToolRun morph(std::vector<std::string> more) const {
    std::vector<std::string> words{"morph", star(), ball(), "--dim", "24"};
    words.insert(words.end(), more.begin(), more.end());
    return runTool(words, {.folder = scratch_.path()});
  }

  static inline std::unique_ptr<ScratchFolder> maps_;
  static inline ToolRun made_, madeBall_;
  ScratchFolder scratch_;
};

std::string metadataOf(const fs::path& path, const std::string& grid, const std::string& key) {
  for (const GridInfo& info : readGridInfo(path)) {
    if (info.name != grid) continue;
    for (const auto& [name, value] : info.metadata) {
      if (name == key) return value;
    }
  }
  return "";
}

TEST_F(Morph, WritesASequenceThatTheJudgeAccepts) {
  const ToolRun run = morph({"--frames", "1-4", "-o", "melt.####.vdb", "--texture", "kiwi", "--texture",
                             "orange", "--ease", "smooth", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(scratch_.names(),
              ElementsAre("melt.0001.vdb", "melt.0002.vdb", "melt.0003.vdb", "melt.0004.vdb"));
  const nlohmann::json json = run.json();
  EXPECT_EQ(json["path"]["kind"], "straight");
  EXPECT_EQ(json["path"]["straight_at_all_times"][0]["open"], 0);
  ASSERT_EQ(json["frames"].size(), 4U);
  for (const auto& frame : json["frames"]) {
    EXPECT_TRUE(frame["proof"]["holds"]);
    EXPECT_EQ(frame["voxel_cells"]["inverted_deep"], 0);
  }
  std::vector<std::string> names;
  for (const GridInfo& info : readGridInfo(scratch_ / "melt.0002.vdb")) {
    names.push_back(info.name);
    EXPECT_EQ(info.role == ValueRole::contravariant, info.name == "vel");
  }
  EXPECT_THAT(names, ElementsAre("surface", "density", "rest", "vel", "Cd"));
  EXPECT_EQ(metadataOf(scratch_ / "melt.0002.vdb", "rest", "polestar:domain"), "ball");
  EXPECT_EQ(metadataOf(scratch_ / "melt.0002.vdb", "rest", "polestar:certificate"), "proved");
  EXPECT_THAT(metadataOf(scratch_ / "melt.0002.vdb", "vel", "polestar:weights"), HasSubstr("0.740741"));

  const ToolRun verified = runTool({"verify", scratch_ / "melt.0002.vdb", "--json"});
  EXPECT_EQ(verified.exitCode, 0) << verified.err << verified.out;
  EXPECT_THAT(verified.out, HasSubstr("not_judged"));
}

TEST_F(Morph, AFarmMakesTheSameFrames) {
  ASSERT_EQ(morph({"--frames", "1-3", "-o", "all.####.vdb"}).exitCode, 0);
  ASSERT_EQ(morph({"--shot", "1-3", "--frames", "2", "-o", "part.####.vdb", "-j", "1"}).exitCode, 0);
  const auto voxels = [&](const std::string& name) {
    std::vector<std::pair<std::string, std::size_t>> counts;
    for (const GridInfo& info : readGridInfo(scratch_ / name))
      counts.emplace_back(info.name, info.activeVoxels);
    return counts;
  };
  EXPECT_EQ(voxels("all.0002.vdb"), voxels("part.0002.vdb"));
  EXPECT_EQ(metadataOf(scratch_ / "all.0002.vdb", "rest", "polestar:weights"),
            metadataOf(scratch_ / "part.0002.vdb", "rest", "polestar:weights"));
  EXPECT_FALSE(fs::exists(scratch_ / "part.0001.vdb"));
}

TEST_F(Morph, SurfacesKeepTheirTriangles) {
  ASSERT_EQ(morph({"--frames", "1-3", "-o", "m.####.vdb", "--mesh", "m.####.ply", "--half"}).exitCode, 0);
  const TriMesh first = readMesh(scratch_ / "m.0001.ply").mesh, last = readMesh(scratch_ / "m.0003.ply").mesh;
  EXPECT_EQ(first.triangles, last.triangles);
  for (const Vec3& vertex : last.vertices) ASSERT_NEAR(vertex.norm(), 1, 0.02);
}

TEST_F(Morph, WeightsGiveStillsAndSequences) {
  ASSERT_EQ(morph({"--weights", "0.25,0.75", "-o", "still.vdb"}).exitCode, 0);
  EXPECT_THAT(metadataOf(scratch_ / "still.vdb", "rest", "polestar:weights"), HasSubstr("0.250000,0.750000"));
  scratch_.file("w.txt", "# there and back\n1 0\n0.5 0.5\n1 0\n");
  const ToolRun run = morph({"--weights", "w.txt", "--frames", "5-7", "-o", "back.####.vdb", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NEAR(run.json()["frames"][0]["volume"], run.json()["frames"][2]["volume"], 1e-12);
  EXPECT_EQ(morph({"--weights", "w.txt", "--frames", "5-8", "-o", "x.####.vdb"}).exitCode, 2);
  EXPECT_EQ(morph({"--weights", "0.5,0.6", "-o", "x.vdb"}).exitCode, 2);
  EXPECT_EQ(morph({"--weights", "0.5,0.3,0.2", "-o", "x.vdb"}).exitCode, 2);
}

TEST_F(Morph, MeshesAreMappedFirst) {
  const ToolRun run =
      runTool({"morph", *maps_ / "star.obj", ball(), "--weights", "1,0", "--dim", "24", "-o", "first.vdb"},
              {.folder = scratch_.path()});
  EXPECT_EQ(run.exitCode, 0) << run.err;
}

TEST_F(Morph, MistakesAreToldBeforeAnythingIsMade) {
  const auto refused = [&](const std::vector<std::string>& more, int code, const std::string& message) {
    const ToolRun run = morph(more);
    EXPECT_EQ(run.exitCode, code) << message;
    EXPECT_THAT(run.err, HasSubstr(message));
  };
  refused({"--frames", "1-3"}, 2, "-o OUT.####.vdb is missing");
  refused({"--frames", "1-3", "-o", "m.vdb"}, 2, "no place for the number");
  refused({"--frames", "1-3", "-o", "m.####.png"}, 2, "does not end in .vdb");
  refused({"-o", "m.####.vdb"}, 2, "which frames?");
  refused({"--frames", "3", "-o", "m.####.vdb"}, 2, "two frames at least");
  refused({"--frames", "1-3", "-o", "m.####.vdb", "--texture", "nothing"}, 2, "nothing");
  refused({"--frames", "5", "--shot", "1-3", "-o", "m.####.vdb"}, 2, "not in the shot");
  refused({"--frames", "1-3", "-o", "m.####.vdb", "--mesh", "m.####.png"}, 2, "--mesh");
  const ToolRun one = runTool({"morph", star(), "--frames", "1-3", "-o", "m.####.vdb"});
  EXPECT_EQ(one.exitCode, 2);
  EXPECT_THAT(one.err, HasSubstr("two shapes at least"));
  const ToolRun missing =
      runTool({"morph", star(), scratch_ / "no.vdb", "--frames", "1-3", "-o", "m.####.vdb"});
  EXPECT_EQ(missing.exitCode, 3);
  scratch_.file("m.0002.vdb", "mine");
  refused({"--frames", "1-3", "-o", "m.####.vdb"}, 3, "exists already");
  EXPECT_THAT(scratch_.names(), ElementsAre("m.0002.vdb"));
}

TEST_F(Morph, ADryRunNamesItsFiles) {
  const ToolRun run = morph({"--frames", "1-2", "-o", "m.####.vdb", "--dry-run"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("m.0001.vdb"), HasSubstr("m.0002.vdb")));
  EXPECT_THAT(scratch_.names(), IsEmpty());
}

}  // namespace
}  // namespace polestar::testing
