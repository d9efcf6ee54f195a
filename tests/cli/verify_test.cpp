// polestar verify, and polestar-verify as a program of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "polestar/core/version.h"
#include "polestar/mesh/shapes.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Verify : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<ScratchFolder>();
    const std::string mesh = folder_->obj("a ball.obj", icosphere(3));
    ASSERT_EQ(runTool({"map", mesh, "-o", grids(), "--dim", "32", "-q"}).exitCode, 0);
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string grids() { return *folder_ / "a ball.vdb"; }
  static std::string map() { return *folder_ / "a ball.pmap"; }

  static inline std::unique_ptr<ScratchFolder> folder_;
};

TEST_F(Verify, PassesWhatMapWrites) {
  for (const std::string& file : {grids(), map()}) {
    const ToolRun run = runTool({"verify", file});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.err, "");
    EXPECT_THAT(run.out, AllOf(StartsWith(file + ": holds\n"), HasSubstr("cells")));
    const auto json = runTool({"verify", file, "--json", "-j", "1"}).json();
    EXPECT_EQ(json["schema"], "polestar/1");
    EXPECT_EQ(json["version"], kVersion);
    EXPECT_EQ(json["command"], "verify");
    EXPECT_EQ(json["inputs"], nlohmann::json::array({file}));
    EXPECT_EQ(json["threads"], 1);
    EXPECT_EQ(json["verdict"], "holds");
    EXPECT_TRUE(json["reason"].is_null());
    EXPECT_GT(json["checks"].size(), 8U);
    for (const auto& check : json["checks"]) EXPECT_TRUE(check["passed"].get<bool>()) << check;
    EXPECT_TRUE(json["timings"].contains("judge"));
    EXPECT_FALSE(json.contains("error"));
  }
}

TEST_F(Verify, RefusalsEndWith6AndTheReason) {
  // Grids that know another center than their own.
  const ScratchFolder scratch;
  const std::string file = scratch / "moved.vdb";
  std::string bytes = readFile(grids());
  // polestar:center is stored in full once a grid, as three doubles.
  const std::string key = "polestar:center";
  for (std::size_t at = bytes.find(key); at != std::string::npos; at = bytes.find(key, at + 1)) {
    const std::size_t type = at + key.size() + 4, value = type + 5 + 4;
    ASSERT_EQ(bytes.substr(type, 5), "vec3d");
    const double moved = 0.3;
    bytes.replace(value, sizeof moved, reinterpret_cast<const char*>(&moved), sizeof moved);
  }
  scratch.file("moved.vdb", bytes);
  const ToolRun run = runTool({"verify", file, "--json"});
  EXPECT_EQ(run.exitCode, 6) << run.err;
  EXPECT_THAT(run.err, StartsWith("polestar verify: " + file + " is refused: pole: "));
  const auto json = run.json();
  EXPECT_EQ(json["verdict"], "refused");
  EXPECT_EQ(json["reason"], "pole");
  EXPECT_EQ(json["error"]["code"], "not_converged");
  EXPECT_THAT(runTool({"verify", file}).out, HasSubstr("REFUSED  pole"));
}

TEST_F(Verify, UnreadableFilesEndWith3) {
  const ScratchFolder scratch;
  std::string bytes = readFile(map());
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  const std::string damaged = scratch.file("damaged.pmap", bytes);
  const std::string cut = scratch.file("cut.vdb", readFile(grids()).substr(0, 20000));
  for (const std::string& file : {damaged, cut, scratch / "missing.vdb", scratch.path().string()}) {
    const ToolRun run = runTool({"verify", file, "--json"});
    EXPECT_EQ(run.exitCode, 3) << file;
    EXPECT_THAT(run.err, AllOf(StartsWith("polestar verify: "), HasSubstr(file)));
    EXPECT_EQ(run.json()["error"]["code"], "io");
  }
  EXPECT_THAT(runTool({"verify", damaged}).err, HasSubstr("hash"));
}

TEST_F(Verify, AnswersGoToAFileWhenAsked) {
  const ScratchFolder scratch;
  const ToolRun run = runTool({"verify", map(), "--json", "-o", scratch / "answer.json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(nlohmann::json::parse(readFile(scratch / "answer.json"))["verdict"], "holds");
  EXPECT_THAT(runTool({"verify", map(), "--dry-run"}).out, HasSubstr("would read " + map()));
}

TEST_F(Verify, TheJudgeRunsAlone) {
  const std::string judge = (fs::path(POLESTAR_TOOL).parent_path() / "polestar-verify").string();
  const auto exitCode = [&](std::vector<std::string> words) {
    words.insert(words.begin(), judge);
    return runProgram(words).exitCode;
  };
  EXPECT_EQ(exitCode({map(), "--quiet"}), 0);
  EXPECT_EQ(exitCode({"--help"}), 0);
  EXPECT_EQ(exitCode({"--version"}), 0);
  EXPECT_EQ(exitCode({}), 2);
  EXPECT_EQ(exitCode({map(), grids()}), 2);
  EXPECT_EQ(exitCode({map(), "--threads", "0"}), 2);
  EXPECT_EQ(exitCode({map(), "--colour"}), 2);
  EXPECT_EQ(exitCode({"missing.pmap"}), 3);
}

}  // namespace
}  // namespace polestar::testing
