#include "cli/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <thread>

namespace polestar::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Progress, LineSaysShareRateAndTimeLeft) {
  EXPECT_EQ(progressLine("solving for G", 0.25, 10), "solving for G: 25 %, 2.5 %/s, 30 s left");
  EXPECT_EQ(progressLine("solving for G", 0, 10), "solving for G: 0 %") << "nothing to extrapolate from";
  EXPECT_THAT(progressLine("tracing", 1.2, 4), HasSubstr("100 %")) << "shares beyond 1 are a whole";
}

TEST(Progress, BarFillsWithTheShareAndFitsTheTerminal) {
  const std::string bar = progressBar("tracing", 0.5, 60, 80);
  EXPECT_THAT(bar, HasSubstr("tracing   50 %"));
  EXPECT_THAT(bar, HasSubstr("[###############...............]"));
  EXPECT_THAT(bar, HasSubstr("1:00 left"));
  for (int width = 1; width < 120; ++width) {
    EXPECT_LT(progressBar("a stage with quite a long name", 0.5, 60, width).size(),
              static_cast<std::size_t>(width));
  }
}

TEST(Progress, NoneIsSilentButMessagesPass) {
  std::ostringstream stream;
  {
    ProgressMeter meter(stream, ProgressMeter::Style::none, "polestar map: ");
    meter.update("tracing", 0.1);
    meter.message("warning: thin part");
  }
  EXPECT_EQ(stream.str(), "polestar map: warning: thin part\n");
}

TEST(Progress, MessagesTakeTheBarAwayFirst) {
  std::ostringstream stream;
  {
    ProgressMeter meter(stream, ProgressMeter::Style::bar, "polestar map: ");
    meter.update("tracing", 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(120));
    meter.update("tracing", 0.5);
    ASSERT_THAT(stream.str(), HasSubstr("tracing   50 %"));
    stream.str("");
    meter.message("hello");
    EXPECT_EQ(stream.str(), "\r\033[Kpolestar map: hello\n");
    stream.str("");
  }
  EXPECT_EQ(stream.str(), "") << "no bar, nothing to clear";
}

TEST(Progress, ShortStagesLeaveNoLinesInLogs) {
  std::ostringstream stream;
  ProgressMeter meter(stream, ProgressMeter::Style::lines, "polestar map: ");
  for (int i = 0; i <= 1000; ++i) meter.update("tracing", i / 1000.0);
  EXPECT_THAT(stream.str(), Not(HasSubstr("tracing")));
}

}  // namespace
}  // namespace polestar::cli
