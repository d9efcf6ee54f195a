// polestar batch as a user runs it; what its parts do is in tests/batch, what it survives in
// tests/integration.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "polestar/mesh/shapes.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class BatchTest : public ::testing::Test {
 protected:
  BatchTest() { folder_.obj("a b.obj", cube(2)); }

  ToolRun batch(const std::string& jobs, std::vector<std::string> more = {}) const {
    folder_.file("jobs.toml", jobs);
    more.insert(more.begin(), {"batch", "jobs.toml"});
    return runTool(more, {.folder = folder_.path()});
  }

  ScratchFolder folder_;
};

const std::string kTarget = "[targets]\n\"it's a\" = \"a b.obj\"\n";

TEST_F(BatchTest, DoesWhatIsToBeDoneAndNoMore) {
  const std::string jobs =
      "output = \"o\"\n[map]\ndim = 8\ntolerance = 0.05\n[render]\nsize = \"32x24\"\nsamples = 1\n" + kTarget;
  const ToolRun first = batch(jobs, {"--json", "--sheet", "sheet.png"});
  ASSERT_EQ(first.exitCode, 0) << first.err;
  EXPECT_EQ(first.json()["report"]["counts"]["done"], 2);
  EXPECT_TRUE(fs::exists(folder_ / "sheet.png"));
  EXPECT_TRUE(fs::exists(folder_ / "o/pictures/it's a.png"));
  EXPECT_EQ(nlohmann::json::parse(readFile(folder_ / "o/report.json"))["counts"]["done"], 2);

  const auto counts = [&](const ToolRun& run) { return run.json()["report"]["counts"]; };
  EXPECT_EQ(counts(batch(jobs, {"--json"}))["up_to_date"], 2);

  // Other options of a step: that step and those after it.
  const std::string finer = std::regex_replace(jobs, std::regex("32x24"), "40x30");
  EXPECT_EQ(counts(batch(finer, {"--json"}))["done"], 1);

  // A damaged result and one that is gone.
  const std::string picture = readFile(folder_ / "o/pictures/it's a.png");
  folder_.file("o/pictures/it's a.png", picture.substr(0, picture.size() / 2));
  EXPECT_EQ(counts(batch(finer, {"--json"}))["done"], 1);
  EXPECT_EQ(readFile(folder_ / "o/pictures/it's a.png"), picture);
  fs::remove(folder_ / "o/maps/it's a.pmap");
  EXPECT_EQ(counts(batch(finer, {"--json"}))["done"], 2);

  // A mesh that was touched after its map.
  fs::last_write_time(folder_ / "a b.obj", fs::file_time_type::clock::now() + std::chrono::seconds(60));
  const ToolRun plan = batch(finer, {"--dry-run", "--json"});
  EXPECT_EQ(plan.exitCode, 0);
  for (const auto& task : plan.json()["dry_run"]["tasks"]) EXPECT_TRUE(task["to_do"].get<bool>());
}

TEST_F(BatchTest, SurfaceMapsAreFollowedAndWatched) {
  const TriMesh ball = icosphere(2);
  folder_.obj("ball.obj", ball);
  const std::string turned =
      folder_.obj("turned.obj", transformed(ball, [](const Vec3& x) { return Vec3(-x.y(), x.x(), x.z()); }));
  const auto make = [&](std::vector<std::string> words) {
    const ToolRun run = runTool(words, {.folder = folder_.path()});
    ASSERT_EQ(run.exitCode, 0) << run.err;
  };
  make({"map", "ball.obj", "-o", "ball.vdb", "--dim", "8", "--tolerance", "0.05"});
  make({"transfer", "kiwi", "ball.vdb", "-o", "mine.vdb"});
  const std::string jobs =
      "output = \"o\"\nsteps = [\"transfer\"]\n[targets]\nb = \"ball.vdb\"\n[textures]\n"
      "mine = { texture = \"mine.vdb\", source = \"ball.pmap\", "
      "transfer = { surface-map = [\"ball.obj\", \"turned.obj\"] } }\n";
  const auto counts = [&] {
    const ToolRun run = batch(jobs, {"--json"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return run.json()["report"]["counts"];
  };
  EXPECT_EQ(counts()["done"], 1);
  EXPECT_EQ(counts()["up_to_date"], 1);
  fs::last_write_time(turned, fs::last_write_time(folder_ / "o/solids/mine/b.vdb") + std::chrono::seconds(1));
  EXPECT_EQ(counts()["done"], 1);
}

TEST_F(BatchTest, MistakesAreFoundBeforeAnythingRuns) {
  const auto refused = [&](const std::string& jobs, const std::string& what,
                           std::vector<std::string> more = {}) {
    const ToolRun run = batch(jobs, more);
    EXPECT_EQ(run.exitCode, 2) << jobs;
    EXPECT_THAT(run.err, HasSubstr(what));
    EXPECT_FALSE(fs::exists(folder_ / "batch"));
  };
  refused("[map]\ndimm = 8\n" + kTarget, "map it's a: ");
  refused("[render]\nsamples = \"many\"\n" + kTarget, "--samples");
  refused(kTarget, "nothing is named kiwi/*", {"--only", "kiwi/*"});
  refused(kTarget, "--shard", {"--shard", "3/2"});
  refused(kTarget, "there is no task 7", {"--task", "7"});
  refused(kTarget, "--wait", {"--wait"});
  refused(kTarget, "-o is for", {"-o", "x.json"});
}

TEST_F(BatchTest, AFailureIsReportedWithItsLog) {
  folder_.file("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const ToolRun run = batch("[map]\ndim = 8\n[targets]\nopen = \"open.obj\"\n", {"--json"});
  EXPECT_EQ(run.exitCode, 7);
  const auto json = run.json();
  EXPECT_EQ(json["error"]["code"], "tasks_failed");
  const auto& task = json["report"]["tasks"][0];
  EXPECT_EQ(task["state"], "failed");
  EXPECT_EQ(task["exit_code"], 4);
  EXPECT_EQ(task["attempts"], 1);
  EXPECT_THAT(readFile(folder_.path() / task["log"].get<std::string>()), HasSubstr("open.obj"));
  // The same of a single task of a plan, with the exit code of its command.
  EXPECT_EQ(batch("[map]\ndim = 8\n[targets]\nopen = \"open.obj\"\n", {"--task", "0"}).exitCode, 4);
  EXPECT_EQ(batch("[map]\ndim = 8\n[targets]\nopen = \"open.obj\"\n", {"--status"}).exitCode, 7);
}

TEST_F(BatchTest, TasksForAFarmNameAPlanThatLasts) {
  const ToolRun run = batch("[map]\ndim = 8\ntolerance = 0.05\n" + kTarget, {"--submit", "print"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  std::smatch plan;
  ASSERT_TRUE(std::regex_search(run.out, plan, std::regex("batch/farm/plan-[0-9a-f]{16}\\.json")));
  // Another job file makes another plan.
  batch("[map]\ndim = 9\n" + kTarget, {"--submit", "print"});
  const ToolRun task = runTool({"batch", plan.str(), "--task", "0"}, {.folder = folder_.path()});
  EXPECT_EQ(task.exitCode, 0) << task.err;
  EXPECT_TRUE(fs::exists(folder_ / "batch/maps/it's a.pmap"));
  const ToolRun open = batch("[map]\ndim = 8\ntolerance = 0.05\n" + kTarget, {"--submit", "openjd"});
  EXPECT_EQ(nlohmann::json::parse(open.out)["steps"].size(), 1U) << "the map is done already";
}

TEST_F(BatchTest, PartsOfAShotAreThoseOfTheWhole) {
  const std::string common =
      "output = \"%\"\nframes = \"1-4\"\n[map]\ndim = 8\ntolerance = 0.05\n[render]\nsize = "
      "\"32x24\"\nsamples = 1\n" +
      kTarget;
  const auto jobs = [&](const std::string& output, const std::string& size) {
    return "frames-per-task = " + size + "\n" + std::regex_replace(common, std::regex("%"), output);
  };
  ASSERT_EQ(batch(jobs("one", "4")).exitCode, 0);
  ASSERT_EQ(batch(jobs("four", "1")).exitCode, 0);
  // The command line is part of a picture: pixels are compared.
  const auto pixels = [&](const std::string& folder, int frame) {
    const std::string bytes =
        readFile(folder_ / (folder + "/pictures/it's a_000" + std::to_string(frame) + ".png"));
    return bytes.substr(bytes.find("IDAT"));
  };
  for (int frame = 1; frame <= 4; ++frame) EXPECT_EQ(pixels("one", frame), pixels("four", frame)) << frame;
  EXPECT_NE(pixels("one", 1), pixels("one", 2));
}

}  // namespace
}  // namespace polestar::testing
