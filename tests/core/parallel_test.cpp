#include "polestar/core/detail/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <set>
#include <thread>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"

namespace polestar::detail {
namespace {

TEST(Parallel, ChunksCoverEveryItemOnceWithFixedBounds) {
  for (const std::size_t count : {0u, 1u, 9u, 10u, 11u, 1234u}) {
    for (const int threads : {1, 2, 5}) {
      std::vector<std::atomic<int>> visits(count);
      std::atomic<bool> boundsHold{true};
      withThreads(threads, [&] {
        parallelChunks(count, 10, [&](std::size_t begin, std::size_t end) {
          if (begin % 10 != 0 || end != std::min(count, begin + 10)) boundsHold = false;
          for (std::size_t i = begin; i < end; ++i) ++visits[i];
        });
      });
      EXPECT_TRUE(boundsHold);
      for (const auto& v : visits) EXPECT_EQ(v, 1);
    }
  }
}

double awkwardSum(int threads) {
  double sum = 0;
  withThreads(threads, [&] {
    // Terms of 30 magnitudes: any change of order shows in the last bits.
    sum = reduceChunks(
        200000, 64, 0.0,
        [](std::size_t begin, std::size_t end) {
          double part = 0;
          for (std::size_t i = begin; i < end; ++i)
            part += std::sin(1.0 + i) * std::exp2(static_cast<double>(i % 30));
          return part;
        },
        std::plus<>());
  });
  return sum;
}

TEST(Parallel, SumsHaveTheSameBytesForAnyNumberOfThreads) {
  const double one = awkwardSum(1);
  for (const int threads : {2, 3, 8, 0}) {
    for (int repeat = 0; repeat < 5; ++repeat) EXPECT_EQ(awkwardSum(threads), one) << threads << " threads";
  }
}

TEST(Parallel, PartsAreCombinedInOrder) {
  const std::vector<std::size_t> order = reduceChunks(
      1000, 7, std::vector<std::size_t>{}, [](std::size_t begin, std::size_t) { return std::vector{begin}; },
      [](std::vector<std::size_t> all, const std::vector<std::size_t>& part) {
        all.insert(all.end(), part.begin(), part.end());
        return all;
      });
  ASSERT_EQ(order.size(), 143u);
  for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], 7 * i);
}

TEST(Parallel, StopsWhenCancelled) {
  Context context;
  std::atomic<int> chunks{0};
  auto body = [&](std::size_t, std::size_t) {
    ++chunks;
    context.cancel();
  };
  try {
    withThreads(1, [&] { parallelChunks(1000, 1, context, body); });
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::cancelled);
  }
  EXPECT_EQ(chunks, 1);
}

TEST(Parallel, ErrorsOfTheBodyReachTheCaller) {
  auto body = [](std::size_t begin, std::size_t) {
    if (begin == 500) throw Error(Errc::io, "item 500");
  };
  EXPECT_THROW(parallelChunks(1000, 1, body), Error);
}

TEST(Threads, OneMeansOne) {
  std::set<std::thread::id> seen;  // no lock: with one thread none is needed
  withThreads(1, [&] {
    parallelChunks(1000, 1, [&](std::size_t, std::size_t) { seen.insert(std::this_thread::get_id()); });
  });
  EXPECT_EQ(seen.size(), 1u);
}

}  // namespace
}  // namespace polestar::detail
