#include "batch/slurm.h"

#include <gtest/gtest.h>

namespace polestar::batch {
namespace {

TEST(ArrayRanges, ListRunsOfNumbers) {
  EXPECT_EQ(arrayRanges({}), "");
  EXPECT_EQ(arrayRanges({4}), "4");
  EXPECT_EQ(arrayRanges({0, 1, 2, 3}), "0-3");
  EXPECT_EQ(arrayRanges({0, 2, 3, 7, 9, 10}), "0,2-3,7,9-10");
}

}  // namespace
}  // namespace polestar::batch
