// Weights of shapes over the frames.
#include "polestar/morph/morph_timeline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>

#include "polestar/core/error.h"

namespace polestar {
namespace {

constexpr Ease kEases[] = {Ease::linear, Ease::smooth, Ease::in, Ease::out};

TEST(MorphTimeline, EasesRiseFromZeroToOne) {
  for (const Ease ease : kEases) {
    EXPECT_EQ(eased(ease, 0), 0) << toString(ease);
    EXPECT_EQ(eased(ease, 1), 1) << toString(ease);
    for (int i = 0; i < 100; ++i) EXPECT_LT(eased(ease, 0.01 * i), eased(ease, 0.01 * (i + 1)));
  }
}

TEST(MorphTimeline, APassageVisitsEveryShapeInTurn) {
  for (const Ease ease : kEases) {
    const MorphTimeline timeline = MorphTimeline::passage(3, 1, 49, ease);
    EXPECT_EQ(timeline.weights(1), (std::vector<double>{1, 0, 0}));
    EXPECT_EQ(timeline.weights(49), (std::vector<double>{0, 0, 1}));
    for (double frame = 1; frame <= 49; frame += 0.5) {
      const std::vector<double> w = timeline.weights(frame);
      EXPECT_NEAR(w[0] + w[1] + w[2], 1, 1e-15);
      for (const double weight : w) EXPECT_GE(weight, 0);
      EXPECT_TRUE(w[0] == 0 || w[2] == 0) << frame;
    }
  }
  EXPECT_EQ(MorphTimeline::passage(3, 1, 49, Ease::linear).weights(25), (std::vector<double>{0, 1, 0}));
}

TEST(MorphTimeline, RatesAreTheDerivative) {
  const MorphTimeline smooth = MorphTimeline::passage(2, 10, 20, Ease::smooth);
  for (const double frame : {10.0, 12.5, 15.0, 20.0}) {
    const double t = (frame - 10) / 10;
    EXPECT_NEAR(smooth.rates(frame)[1], 6 * t * (1 - t) / 10, 2e-6);
    EXPECT_NEAR(smooth.rates(frame)[0], -6 * t * (1 - t) / 10, 2e-6);
  }
  const MorphTimeline passage = MorphTimeline::passage(3, 0, 10, Ease::linear);
  EXPECT_NEAR(passage.rates(0)[1], 0.2, 1e-9) << "at the end that of the inside";
  EXPECT_NEAR(passage.rates(5)[0], -0.1, 1e-9) << "in a corner the mean of both sides";
  EXPECT_NEAR(passage.rates(5)[1], 0, 1e-9);
}

TEST(MorphTimeline, RowsAreKeptAndJoined) {
  const MorphTimeline timeline = MorphTimeline::keyed(5, 7, {{1, 0}, {0.25, 0.75}, {0.5, 0.5}});
  EXPECT_EQ(timeline.weights(5), (std::vector<double>{1, 0}));
  EXPECT_EQ(timeline.weights(6), (std::vector<double>{0.25, 0.75}));
  EXPECT_NEAR(timeline.weights(6.5)[0], 0.375, 1e-15);
  EXPECT_EQ(timeline.weights(99), (std::vector<double>{0.5, 0.5}));
  const MorphTimeline still = MorphTimeline::still({0.5, 0.3, 0.2000004});
  const std::vector<double> shares = still.weights(3);
  EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1, 1e-15);
  EXPECT_EQ(still.rates(3), (std::vector<double>{0, 0, 0}));
}

void expectUsage(const std::function<void()>& call) {
  try {
    call();
    FAIL() << "nothing was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::usage) << error.what();
  }
}

TEST(MorphTimeline, ImpossibleWeightsAreRefused) {
  expectUsage([] { MorphTimeline::still({0.5, 0.6}); });
  expectUsage([] { MorphTimeline::still({-0.5, 1.5}); });
  expectUsage([] { MorphTimeline::still({std::nan(""), 1}); });
  expectUsage([] { MorphTimeline::keyed(1, 2, {{1, 0}, {1}}); });
  expectUsage([] { MorphTimeline::keyed(2, 2, {{1, 0}, {0, 1}}); });
  expectUsage([] { MorphTimeline::passage(1, 1, 48, Ease::linear); });
  expectUsage([] { MorphTimeline::passage(2, 1, 1, Ease::linear); });
}

}  // namespace
}  // namespace polestar
