// polestar eval: how points are read, and what a point list may look like.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polestar/mesh/shapes.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class Eval : public ::testing::Test {
 protected:
  ScratchFolder scratch_;
  std::string ball_ = scratch_.obj("ball.obj", icosphere(2));
};

TEST_F(Eval, BadPointsAreNamedByLine) {
  const std::string points = scratch_.file("points.txt", "# corners\n0 0 0\n\n0.1,0.2\n");
  ToolRun run = runTool({"eval", ball_, "--points", points});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, StartsWith("polestar eval: " + points + ", line 4: "));
  EXPECT_THAT(run.err, HasSubstr("\"0.1,0.2\""));

  run = runTool({"eval", ball_, "--points", "-"}, {.input = "0 0 nan\n"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, StartsWith("polestar eval: standard input, line 1: "));
}

TEST_F(Eval, EmptyAndMissingPointListsEndWith3) {
  EXPECT_EQ(runTool({"eval", ball_, "--points", scratch_ / "missing.txt"}).exitCode, 3);
  EXPECT_EQ(runTool({"eval", ball_, "--points", scratch_.file("empty.txt", "\n# nothing\n")}).exitCode, 3);
  EXPECT_EQ(runTool({"eval", ball_, "--points", scratch_.path().string()}).exitCode, 3);
}

TEST_F(Eval, InterruptedWaitingEndsWith130) {
  const auto before = scratch_.names();
  const ToolRun run =
      runTool({"eval", ball_, "--points", "-", "-o", scratch_ / "out.json", "--json"},
              {.interruptAfter = std::chrono::milliseconds(300), .limit = std::chrono::seconds(20)});
  EXPECT_FALSE(run.hung);
  EXPECT_EQ(run.exitCode, 130);
  EXPECT_THAT(run.err, HasSubstr("cancelled"));
  EXPECT_EQ(run.json()["error"]["code"], "cancelled");
  EXPECT_EQ(scratch_.names(), before);
}

}  // namespace
}  // namespace polestar::testing
