// Batches that are killed, run twice at once, or run out of room.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <thread>

#include "../cli/run_tool.h"
#include "batch_results.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

constexpr int kKills = 3;  // POLESTAR_KILLS: another number

constexpr const char* kJobs = R"(
output = "out"
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
wood = "tree-rings"
marble = "marble"
[targets]
cube = "cube.obj"
)";

class BatchFaultsTest : public ::testing::Test {
 protected:
  BatchFaultsTest() { prepare(folder_.path()); }

  static void prepare(const fs::path& folder) {
    fs::copy_file(fs::path(POLESTAR_VOLUMES_FOLDER) / "cube.obj", folder / "cube.obj");
    std::ofstream(folder / "jobs.toml") << kJobs;
  }

  static ToolRun batch(const fs::path& folder, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"batch", "jobs.toml", "-j", "2"});
    return runTool(more, {.folder = folder, .limit = std::chrono::seconds(200)});
  }

  ScratchFolder folder_;
};

/// Starts a batch and kills it, and it alone, after a while.
void killAfter(const fs::path& folder, std::chrono::milliseconds delay) {
  std::string words[] = {POLESTAR_TOOL, "batch", "jobs.toml", "-j", "2", "-q"};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t process = 0;
  ASSERT_EQ(posix_spawn(&process, POLESTAR_TOOL, &actions, nullptr, arguments.data(), environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  std::this_thread::sleep_for(delay);
  kill(process, SIGKILL);
  waitpid(process, nullptr, 0);
}

TEST_F(BatchFaultsTest, KilledAtAnyMomentItGoesOnToTheSameBytes) {
  const auto start = Clock::now();
  ASSERT_EQ(batch(folder_.path()).exitCode, 0);
  const auto whole = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - start);
  const auto expected = batchResults(folder_ / "out");
  ASSERT_EQ(expected.size(), 2U + 3U + 3U);
  const char* asked = std::getenv("POLESTAR_KILLS");
  const int kills = asked ? std::atoi(asked) : kKills;
  std::mt19937 random(7);
  for (int i = 0; i < kills; ++i) {
    const ScratchFolder other;
    prepare(other.path());
    const std::chrono::milliseconds delay(random() % static_cast<unsigned>(whole.count()));
    killAfter(other.path(), delay);
    const ToolRun resumed = batch(other.path());
    EXPECT_EQ(resumed.exitCode, 0) << resumed.err;
    // No less and no more: leftovers of what was killed would be here, too.
    EXPECT_EQ(batchResults(other / "out"), expected) << "killed after " << delay.count() << " ms";
  }
}

TEST_F(BatchFaultsTest, TwoAtOnceShareTheWork) {
  ToolRun first, second;
  std::thread other([&] { first = batch(folder_.path(), {"--json"}); });
  second = batch(folder_.path(), {"--json"});
  other.join();
  EXPECT_EQ(first.exitCode, 0) << first.err;
  EXPECT_EQ(second.exitCode, 0) << second.err;
  const auto done = [](const ToolRun& run) { return run.json()["report"]["counts"]["done"].get<int>(); };
  // Each task was done by one of them.
  EXPECT_EQ(done(first) + done(second), 1 + 3 + 3);
}

TEST_F(BatchFaultsTest, AFullDiskFailsWhatDoesNotFit) {
  const fs::path disk = folder_.path() / "disk";
  fs::create_directory(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=400k") != 0)
    GTEST_SKIP() << "may not mount a tmpfs here";
  prepare(disk);
  const ToolRun full = batch(disk, {"--json"});
  EXPECT_EQ(full.exitCode, 7) << full.err;
  EXPECT_THAT(full.err, ContainsRegex("is the disk full|the disk is full"));
  for (const auto& entry : fs::recursive_directory_iterator(disk))
    EXPECT_NE(entry.path().extension(), ".part");
  // Room again: it goes on.
  EXPECT_EQ(mount("tmpfs", disk.c_str(), "tmpfs", MS_REMOUNT, "size=64m"), 0);
  EXPECT_EQ(batch(disk).exitCode, 0);
  EXPECT_EQ(batchResults(disk / "out").size(), 8U);
  umount(disk.c_str());
}

TEST_F(BatchFaultsTest, AFolderThatMayNotBeWrittenIsSaid) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  fs::permissions(folder_.path(), fs::perms(0555));
  const ToolRun refused = batch(folder_.path());
  fs::permissions(folder_.path(), fs::perms(0755));
  EXPECT_EQ(refused.exitCode, 3);
  EXPECT_THAT(refused.err, HasSubstr("cannot make the folder"));
}

}  // namespace
}  // namespace polestar::testing
