// Tasks run here, with commands that do what a test wants in place of polestar's.

#include "batch/local_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <thread>

#include "batch/child.h"
#include "polestar/core/error.h"
#include "support/scratch_folder.h"

namespace polestar::batch {
namespace {

using ::testing::HasSubstr;

/// A plan of tasks that write nothing: these are never up to date.
class LocalRunTest : public ::testing::Test {
 protected:
  LocalRunTest() {
    plan_.folder = folder_.path();
    plan_.output = "out";
  }

  std::size_t add(const std::string& what, const std::vector<std::size_t>& after = {}) {
    const std::string name = std::to_string(plan_.tasks.size());
    plan_.tasks.push_back({.step = after.empty() ? Step::map : Step::render,
                           .name = name,
                           .arguments = {what},
                           .inputs = {},
                           .outputs = {"out/" + name + ".png"},
                           .after = after,
                           .log = "out/logs/" + name + ".log"});
    return plan_.tasks.size() - 1;
  }

  std::vector<TaskResult> run(RunOptions options = {}, Context& context = Context::quiet()) {
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < plan_.tasks.size(); ++i) all.push_back(i);
    return runLocally(plan_, all, command_, options, context,
                      [this](const RunCounts& counts) { most_ = std::max(most_, counts.running.size()); });
  }

  /// What the words of a task stand for, in its process.
  static int obey(const std::vector<std::string>& words) {
    const std::string& what = words.front();
    if (what == "crash") std::abort();
    if (what == "refuse") {
      std::cout << R"({"error": {"message": "the mesh has a hole"}})";
      return 4;
    }
    if (what == "stumble") {  // fails the first time
      if (access("stumbled", F_OK) == 0) return 0;
      test::writeBytes("stumbled", "");
      return 3;
    }
    if (what == "sleep") std::this_thread::sleep_for(std::chrono::seconds(30));
    if (what == "nap") std::this_thread::sleep_for(std::chrono::milliseconds(200));
    std::cerr << "did " << what << std::endl;
    return 0;
  }

  test::ScratchFolder folder_;
  Plan plan_;
  RunCommand command_ = obey;
  std::size_t most_ = 0;
};

TEST_F(LocalRunTest, OneThatFailsStopsNoOther) {
  const auto good = add("work"), bad = add("refuse"), crash = add("crash");
  const auto needsGood = add("work", {good}), needsBad = add("work", {good, bad}),
             needsSkipped = add("work", {needsBad});
  const auto results = run({.threads = 2, .atOnce = 0, .retries = 0, .needsAreElsewhere = false});
  EXPECT_EQ(results[good].state, TaskState::done);
  EXPECT_EQ(results[needsGood].state, TaskState::done);
  EXPECT_EQ(results[bad].state, TaskState::failed);
  EXPECT_EQ(results[bad].exitCode, 4);
  EXPECT_EQ(results[bad].error, "the mesh has a hole");
  EXPECT_EQ(results[crash].state, TaskState::failed);
  EXPECT_EQ(results[crash].exitCode, 128 + SIGABRT);
  EXPECT_THAT(results[crash].error, HasSubstr("signal 6"));
  EXPECT_EQ(results[needsBad].state, TaskState::skipped);
  EXPECT_THAT(results[needsBad].error, HasSubstr("map 1"));
  EXPECT_EQ(results[needsSkipped].state, TaskState::skipped);
  EXPECT_THAT(test::bytesOf(folder_ / "out/logs/0.log"), HasSubstr("did work"));
  const Json record = Json::parse(test::bytesOf(folder_ / "out/logs/1.json"));
  EXPECT_EQ(record["exit_code"], 4);
  EXPECT_EQ(record["error"], "the mesh has a hole");
}

TEST_F(LocalRunTest, OnlyWhatMayPassIsTriedAgain) {
  const auto stumbles = add("stumble"), bad = add("refuse"), crash = add("crash");
  const auto results = run({.threads = 1, .atOnce = 0, .retries = 2, .needsAreElsewhere = false});
  EXPECT_EQ(results[stumbles].state, TaskState::done);
  EXPECT_EQ(results[stumbles].attempts, 2);
  EXPECT_EQ(results[bad].attempts, 1);
  EXPECT_EQ(results[crash].attempts, 3);
}

TEST_F(LocalRunTest, NoMoreRunAtOnceThanAsked) {
  for (int i = 0; i < 6; ++i) add("nap");
  run({.threads = 4, .atOnce = 2, .retries = 0, .needsAreElsewhere = false});
  EXPECT_EQ(most_, 2U);
  most_ = 0;
  run({.threads = 3, .atOnce = 0, .retries = 0, .needsAreElsewhere = false});
  EXPECT_EQ(most_, 3U);
}

TEST_F(LocalRunTest, FewTasksShareAllThreads) {
  const auto first = add("first"), second = add("second", {first});
  add("third", {first});
  command_ = [](const std::vector<std::string>& words) {
    // ... -j N
    std::cout << R"({"error": {"message": ")" + words.front() + " " + words.back() + "\"}}";
    return words.front() == "first" ? 0 : 2;
  };
  const auto results = run({.threads = 8, .atOnce = 0, .retries = 0, .needsAreElsewhere = false});
  EXPECT_EQ(results[second].error, "second 4");
  EXPECT_EQ(results[second + 1].error, "third 4");
  EXPECT_EQ(Json::parse(test::bytesOf(folder_ / "out/logs/0.json"))["answer"]["error"]["message"], "first 8");
}

TEST_F(LocalRunTest, ATaskThatAnotherHasIsLeftToIt) {
  const auto taken = add("work"), other = add("work");
  std::filesystem::create_directories(folder_ / "out/logs");
  Descriptor lock = openLocked(folder_ / plan_.tasks[taken].log);
  ASSERT_TRUE(lock);
  EXPECT_FALSE(openLocked(folder_ / plan_.tasks[taken].log));
  std::vector<TaskResult> results;
  std::thread release([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    EXPECT_THAT(test::bytesOf(folder_ / plan_.tasks[other].log), HasSubstr("did work"));
    EXPECT_EQ(test::bytesOf(folder_ / plan_.tasks[taken].log), "");
    lock = Descriptor();
  });
  results = run({.threads = 2, .atOnce = 0, .retries = 0, .needsAreElsewhere = false});
  release.join();
  EXPECT_EQ(results[taken].state, TaskState::done);
  EXPECT_EQ(results[other].state, TaskState::done);
}

TEST_F(LocalRunTest, CancelEndsTheTasks) {
  add("sleep");
  add("sleep");
  Context context;
  std::thread interrupt([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    context.cancel();
  });
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THROW(run({.threads = 2, .atOnce = 0, .retries = 0, .needsAreElsewhere = false}, context), Error);
  interrupt.join();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(8));
  // Their locks are free: they are gone.
  EXPECT_TRUE(openLocked(folder_ / plan_.tasks[0].log));
}

TEST_F(LocalRunTest, WhatAKilledProcessLeftIsRemoved) {
  add("work");
  std::filesystem::create_directories(folder_ / "out");
  test::writeBytes(folder_ / "out/.0.png.4711-0.part", "half");
  test::writeBytes(folder_ / "out/.1.png.4711-0.part", "another's");
  run();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/.0.png.4711-0.part"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/.1.png.4711-0.part"));
}

TEST(RunProgram, SaysWhenThereIsNone) {
  EXPECT_EQ(runProgram({"polestar-no-such-program"}).exitCode, 127);
  EXPECT_EQ(runProgram({"printf", "%s", "a b"}).out, "a b");
  EXPECT_EQ(runProgram({"false"}).exitCode, 1);
}

}  // namespace
}  // namespace polestar::batch
