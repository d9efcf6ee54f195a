#include "polestar/core/context.h"

#include <gtest/gtest.h>

#include "polestar/core/error.h"

namespace polestar {
namespace {

TEST(Context, CancelsOnceAsked) {
  Context context;
  EXPECT_NO_THROW(context.throwIfCancelled());
  context.cancel();
  EXPECT_TRUE(context.cancelled());
  try {
    context.throwIfCancelled();
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::cancelled);
  }
}

TEST(Context, CallbacksAreOptionalAndReceiveWhatIsSaid) {
  Context context;
  context.progress("anything", 0.5);
  context.log(LogLevel::info, "anything");

  double seen = 0;
  std::string message;
  context.onProgress = [&](std::string_view, double fraction) { seen = fraction; };
  context.onLog = [&](LogLevel, std::string_view text) { message = text; };
  context.progress("solving", 0.25);
  context.log(LogLevel::warning, "careful");
  EXPECT_EQ(seen, 0.25);
  EXPECT_EQ(message, "careful");
}

TEST(Context, TheQuietOneIsNotCancelled) { EXPECT_FALSE(Context::quiet().cancelled()); }

}  // namespace
}  // namespace polestar
