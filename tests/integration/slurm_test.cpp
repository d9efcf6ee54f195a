// Batches on a real Slurm: one node, on the loopback interface.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <map>
#include <sstream>
#include <thread>

#include "../cli/run_tool.h"
#include "batch_results.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr const char* kNobody = "65534";

constexpr const char* kJobs = R"toml(
output = "out put"
retries = 1
[map]
dim = 16
tolerance = 0.05
[transfer]
dim = 16
[render]
size = "48x36"
samples = 4
[textures]
kiwi = "kiwi"
"it's $(wood)" = "tree-rings"
[targets]
"größe 1" = "cube.obj"
late = "late.obj"
)toml";

/// A cluster with a folder for jobs. Slurm's daemons and all of their clients are one ordinary user: where
/// tests run as root, nobody.
class SlurmTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists("/usr/sbin/slurmctld") || !fs::exists("/usr/sbin/munged"))
      GTEST_SKIP() << "no Slurm here: install slurmctld, slurmd, slurm-client and munge";
    fs::create_directory(cluster_);
    fs::create_directory(jobs_);
    fs::permissions(folder_.path(), fs::perms(0755));
    fs::copy_file(fs::path(POLESTAR_VOLUMES_FOLDER) / "cube.obj", jobs_ / "cube.obj");
    write("jobs.toml", kJobs);
    giveAway();
    const ToolRun started = control("start");
    ASSERT_EQ(started.exitCode, 0) << started.err;
    running_ = true;
  }

  void TearDown() override {
    if (running_) control("stop");
  }

  void write(const std::string& name, const std::string& text) const {
    folder_.file("jobs/" + name, text);
    giveAway();
  }

  void giveAway() const {
    if (geteuid() != 0) return;
    const std::string owner = std::string(kNobody) + ":" + kNobody;
    ASSERT_EQ(runProgram({"/usr/bin/chown", "-R", owner, folder_.path().string()}).exitCode, 0);
  }

  /// As the cluster's user, in the folder of jobs.
  ToolRun run(std::vector<std::string> words) const {
    std::vector<std::string> all;
    if (geteuid() == 0) all = {"/usr/bin/setpriv", "--reuid", kNobody, "--regid", kNobody, "--clear-groups"};
    all.insert(all.end(), {"/usr/bin/env", "SLURM_CONF=" + (cluster_ / "slurm.conf").string(),
                           "SLURM_TEST_MAX_ARRAY=4"});
    all.insert(all.end(), words.begin(), words.end());
    return runProgram(all, {.folder = jobs_, .limit = std::chrono::seconds(280)});
  }

  ToolRun control(const std::string& action) const {
    return run({"bash", POLESTAR_INTEGRATION_FOLDER "/slurm_cluster.sh", action, cluster_.string()});
  }

  ToolRun batch(std::vector<std::string> words) const {
    words.insert(words.begin(), {POLESTAR_TOOL, "batch", "jobs.toml"});
    return run(words);
  }

  std::size_t submittedTasks(const nlohmann::json& json) const {
    std::size_t sum = 0;
    for (const auto& job : json.at("submitted")) sum += job.at("tasks").get<std::size_t>();
    return sum;
  }

  /// Waits until a task of the batch is at work.
  void waitForTask() const {
    for (int i = 0; i < 600; ++i) {
      if (run({"squeue", "-h", "-t", "R", "-o", "%i"}).out != "") return;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    ADD_FAILURE() << "no task ever ran";
  }

  /// Slurm lets a job that it put back wait for two minutes.
  void startAtOnce() const {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    std::istringstream ids(run({"squeue", "-h", "-r", "-t", "PD", "-o", "%i"}).out);
    for (std::string id; ids >> id;) run({"scontrol", "update", "jobid=" + id, "starttime=now"});
  }

  ScratchFolder folder_;
  const fs::path cluster_ = folder_.path() / "cluster", jobs_ = folder_.path() / "jobs";
  bool running_ = false;
};

TEST_F(SlurmTest, AnArrayWithATaskThatFailsAndIsSubmittedAgain) {
  const ToolRun first = batch({"--submit", "slurm", "--wait", "--json"});
  EXPECT_EQ(first.exitCode, 7) << first.err;
  const auto report = first.json();
  EXPECT_EQ(report["report"]["counts"]["up_to_date"], 1 + 2 + 2);
  EXPECT_EQ(report["report"]["counts"]["failed"], 1);
  EXPECT_EQ(report["report"]["counts"]["skipped"], 2 + 2);
  // Arrays of at most four numbers.
  EXPECT_GE(report["submitted"].size(), 3U + 1U);
  for (const auto& job : report["submitted"]) EXPECT_LE(job["tasks"], 4);
  EXPECT_THAT(readFile(jobs_ / "out put/logs/map/late.log"), HasSubstr("late.obj"));

  fs::copy_file(jobs_ / "cube.obj", jobs_ / "late.obj");
  giveAway();
  const ToolRun second = batch({"--submit", "slurm", "--wait", "--json", "--sheet", "sheet.png"});
  EXPECT_EQ(second.exitCode, 0) << second.err;
  EXPECT_EQ(submittedTasks(second.json()), 1U + 2U + 2U);
  EXPECT_EQ(second.json()["report"]["counts"]["up_to_date"], 2 + 4 + 4);
  EXPECT_TRUE(fs::exists(jobs_ / "sheet.png"));

  // The same bytes as without a farm.
  const auto farmed = batchResults(jobs_ / "out put");
  fs::remove_all(jobs_ / "out put");
  EXPECT_EQ(batch({}).exitCode, 0);
  EXPECT_EQ(batchResults(jobs_ / "out put"), farmed);
}

TEST_F(SlurmTest, WhatIsInTheQueueIsNotSubmittedTwice) {
  const ToolRun first = batch({"--submit", "slurm"});
  EXPECT_EQ(first.exitCode, 0) << first.err;
  const ToolRun second = batch({"--submit", "slurm"});
  EXPECT_EQ(second.exitCode, 3);
  EXPECT_THAT(second.err, HasSubstr("in the queue already"));
  EXPECT_THAT(second.err, HasSubstr("scancel"));
}

TEST_F(SlurmTest, TasksThatDieAndANodeThatGoesDownAreMadeUpFor) {
  fs::copy_file(jobs_ / "cube.obj", jobs_ / "late.obj");
  giveAway();
  ToolRun waited;
  std::thread waiting([&] { waited = batch({"--submit", "slurm", "--wait", "--json"}); });
  waitForTask();
  // A task's process, without a chance to clean up.
  run({"pkill", "-9", "-f", "^" POLESTAR_TOOL " batch .* --task"});
  std::this_thread::sleep_for(std::chrono::seconds(1));
  waitForTask();
  const std::string node = "nodename=" + run({"sinfo", "-h", "-o", "%n"}).out;
  const auto setNode = [&](const std::string& state) {
    return run({"scontrol", "update", node.substr(0, node.find('\n')), state, "reason=test"}).exitCode;
  };
  EXPECT_EQ(setNode("state=down"), 0);
  control("stop-node");
  std::this_thread::sleep_for(std::chrono::seconds(2));
  control("start-node");
  setNode("state=resume");
  startAtOnce();
  waiting.join();
  EXPECT_EQ(waited.exitCode, 0) << waited.err << waited.out;
  EXPECT_EQ(waited.json()["report"]["counts"]["up_to_date"], 2 + 4 + 4);
}

}  // namespace
}  // namespace polestar::testing
