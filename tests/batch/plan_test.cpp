// From job files to tasks: which there are, what they need, and how options reach them.

#include "batch/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polestar/core/error.h"
#include "support/scratch_folder.h"

namespace polestar::batch {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

class PlanTest : public ::testing::Test {
 protected:
  Plan plan(const std::string& text) const {
    test::writeBytes(folder_ / "jobs.toml", text);
    return makePlan(readJobFile(folder_ / "jobs.toml"));
  }

  static const Task& find(const Plan& plan, const std::string& label) {
    for (const Task& task : plan.tasks) {
      if (task.label() == label) return task;
    }
    throw std::runtime_error("there is no task " + label);
  }

  static std::vector<std::string> labels(const Plan& plan, const std::vector<std::size_t>& tasks) {
    std::vector<std::string> result;
    for (const std::size_t i : tasks) result.push_back(plan.tasks[i].label());
    return result;
  }

  test::ScratchFolder folder_;
};

constexpr const char* kTwoByTwo = R"(
output = "out"
[textures]
kiwi = "kiwi"
wood = "tree-rings"
[targets]
a = "a.obj"
b = "b.pmap"
)";

TEST_F(PlanTest, PairsGoThroughAllSteps) {
  const Plan made = plan(kTwoByTwo);
  std::vector<std::string> all;
  for (const Task& task : made.tasks) all.push_back(task.label());
  EXPECT_THAT(all,
              ElementsAre("map a", "transfer kiwi/a", "transfer kiwi/b", "transfer wood/a", "transfer wood/b",
                          "render kiwi/a", "render kiwi/b", "render wood/a", "render wood/b"));
  EXPECT_THAT(find(made, "map a").arguments, ElementsAre("map", "a.obj", "-o", "out/maps/a.vdb"));
  EXPECT_THAT(find(made, "map a").outputs, ElementsAre("out/maps/a.vdb", "out/maps/a.pmap"));
  EXPECT_THAT(find(made, "transfer kiwi/a").arguments,
              ElementsAre("transfer", "kiwi", "out/maps/a.vdb", "-o", "out/solids/kiwi/a.vdb"));
  EXPECT_THAT(labels(made, find(made, "transfer kiwi/a").after), ElementsAre("map a"));
  EXPECT_THAT(find(made, "transfer kiwi/b").after, ElementsAre());
  EXPECT_THAT(find(made, "render kiwi/a").arguments,
              ElementsAre("render", "out/solids/kiwi/a.vdb", "-o", "out/pictures/kiwi/a.png"));
  EXPECT_THAT(labels(made, made.ends()),
              ElementsAre("render kiwi/a", "render kiwi/b", "render wood/a", "render wood/b"));
}

TEST_F(PlanTest, NeedsComeAlong) {
  const Plan made = plan(kTwoByTwo);
  EXPECT_THAT(labels(made, made.withNeeds({5})), ElementsAre("map a", "transfer kiwi/a", "render kiwi/a"));
}

TEST_F(PlanTest, LaterOptionsTakeThePlaceOfEarlierOnes) {
  const Plan made = plan(R"(
[transfer]
dim = 64
half = true
[textures]
kiwi = { texture = "kiwi", transfer = { dim = 96 } }
wood = "tree-rings"
[targets]
a = { mesh = "a.obj", map = { dim = 32 }, transfer = { half = false } }
b = "b.obj"
[[override]]
texture = "k*"
target = "b"
transfer = { dim = 128 }
map = { dim = 16 }
)");
  // A map is shared by all textures, so what is said for one texture does not touch it.
  EXPECT_THAT(find(made, "map b").arguments, Not(Contains("--dim=16")));
  EXPECT_THAT(find(made, "map a").arguments, Contains("--dim=32"));
  EXPECT_THAT(find(made, "transfer wood/b").arguments, Contains("--dim=64"));
  EXPECT_THAT(find(made, "transfer wood/b").arguments, Contains("--half"));
  EXPECT_THAT(find(made, "transfer kiwi/a").arguments, Contains("--dim=96"));
  EXPECT_THAT(find(made, "transfer kiwi/a").arguments, Not(Contains("--half")));
  EXPECT_THAT(find(made, "transfer kiwi/b").arguments, Contains("--dim=128"));
  // A voxel size of its own: the map's grids are not asked for theirs.
  EXPECT_THAT(find(made, "transfer kiwi/b").arguments, Contains("batch/maps/b.pmap"));
}

TEST_F(PlanTest, AStillTargetTurnsInPieces) {
  const Plan made = plan("frames = \"1-10x3\"\nframes-per-task = 3\n[targets]\na = \"a.obj\"\n");
  EXPECT_THAT(find(made, "render a 1-7x3").arguments, Contains("--frames=1-7x3"));
  EXPECT_THAT(find(made, "render a 1-7x3").arguments, Contains("--shot=1-10x3"));
  EXPECT_THAT(
      find(made, "render a 1-7x3").outputs,
      ElementsAre("batch/pictures/a_0001.png", "batch/pictures/a_0004.png", "batch/pictures/a_0007.png"));
  EXPECT_THAT(find(made, "render a 10").outputs, ElementsAre("batch/pictures/a_0010.png"));
  EXPECT_THAT(find(made, "render a 10").inputs, ElementsAre("batch/maps/a.vdb"));
}

TEST_F(PlanTest, ASequenceIsMappedFrameByFrame) {
  const Plan made = plan(R"(
frames = "1-2"
[textures]
kiwi = "kiwi"
[targets]
blob = "blob.####.obj"
)");
  EXPECT_THAT(find(made, "map blob 2").arguments,
              ElementsAre("map", "blob.0002.obj", "-o", "batch/maps/blob_0002.vdb"));
  EXPECT_THAT(labels(made, find(made, "transfer kiwi/blob 2").after), ElementsAre("map blob 2"));
  // The camera is that of the whole shot.
  EXPECT_THAT(labels(made, find(made, "render kiwi/blob 1").after),
              ElementsAre("transfer kiwi/blob 1", "transfer kiwi/blob 2"));
  EXPECT_THROW(plan("[targets]\nblob = \"blob.####.obj\"\n"), Error);
}

TEST_F(PlanTest, TheSolidOfAFilesTextureIsMappedOnce) {
  const Plan made = plan(R"(
[textures]
ct = { texture = "ct.####.tif", source = "block.ply" }
mine = { texture = "mine.vdb", source = "mine.pmap" }
[targets]
a = "a.obj"
block = "b.obj"
)");
  EXPECT_THAT(labels(made, find(made, "transfer ct/a").after), ElementsAre("map sources/ct", "map a"));
  EXPECT_THAT(find(made, "transfer ct/a").arguments, Contains("--source=batch/maps/sources/ct.pmap"));
  EXPECT_THAT(find(made, "transfer mine/a").arguments, Contains("--source=mine.pmap"));
  EXPECT_THAT(find(made, "transfer mine/a").inputs, Contains("mine.vdb"));
}

TEST_F(PlanTest, FilesThatOptionsNameAreInputs) {
  const Plan made = plan(R"(
[map]
domain = "polycube"
polycube = "cells.txt"
[textures]
mine = { texture = "mine.vdb", source = "mine.pmap", transfer = { surface-map = ["on mine.ply", "on a.ply"] } }
kiwi = { texture = "kiwi", transfer = { landmarks = "pairs.csv" } }
[targets]
a = "a.obj"
)");
  const Task& followed = find(made, "transfer mine/a");
  EXPECT_THAT(followed.inputs, IsSupersetOf({"on mine.ply", "on a.ply"}));
  const std::vector<std::string> last(followed.arguments.end() - 2, followed.arguments.end());
  EXPECT_THAT(last, ElementsAre("--surface-map=on mine.ply", "--surface-map=on a.ply"));
  EXPECT_THAT(find(made, "transfer kiwi/a").inputs, Contains("pairs.csv"));
  EXPECT_THAT(find(made, "map a").inputs, ElementsAre("a.obj", "cells.txt"));
}

TEST_F(PlanTest, WithoutATransferTexturesAreDrawnFromTheMap) {
  const Plan made =
      plan("steps = [\"map\", \"render\"]\n[textures]\nkiwi = \"kiwi\"\n[targets]\na = \"a.obj\"\n");
  EXPECT_THAT(find(made, "render kiwi/a").arguments,
              ElementsAre("render", "batch/maps/a.vdb", "-o", "batch/pictures/kiwi/a.png", "--texture=kiwi"));
  EXPECT_THROW(plan("steps = [\"map\", \"render\"]\n[textures]\nk = \"k.vdb\"\n[targets]\na = \"a.obj\"\n"),
               Error);
  EXPECT_THROW(plan("steps = [\"render\"]\n[targets]\na = \"a.obj\"\n"), Error);
}

TEST_F(PlanTest, FilesThatLookLikeOptionsAreNone) {
  const Plan made = plan("[targets]\na = \"-a.obj\"\n");
  EXPECT_THAT(find(made, "map a").arguments, Contains("./-a.obj"));
}

TEST_F(PlanTest, APlanLastsAsAFile) {
  const Plan made = plan(kTwoByTwo);
  test::writeBytes(folder_ / "plan.json", toJson(made).dump());
  const Plan read = readPlan(folder_ / "plan.json");
  EXPECT_EQ(toJson(read), toJson(made));
  test::writeBytes(folder_ / "plan.json", "{\"schema\": \"polestar-plan/1\"}");
  EXPECT_THROW(readPlan(folder_ / "plan.json"), Error);
  test::writeBytes(folder_ / "plan.json", "[targets]");
  EXPECT_THROW(readPlan(folder_ / "plan.json"), Error);
}

}  // namespace
}  // namespace polestar::batch
