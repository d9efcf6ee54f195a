#include "cli/text.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>

#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

TEST(Text, CountsAreGroupedByThousands) {
  EXPECT_EQ(grouped(0), "0");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1000), "1,000");
  EXPECT_EQ(grouped(1234567), "1,234,567");
  EXPECT_EQ(counted(1, "vertex", "vertices"), "1 vertex");
  EXPECT_EQ(counted(0, "vertex", "vertices"), "0 vertices");
}

TEST(Text, DurationsKeepTheDigitsThatMatter) {
  EXPECT_EQ(duration(0.84), "0.8 s");
  EXPECT_EQ(duration(9.96), "10 s");
  EXPECT_EQ(duration(59.4), "59 s");
  EXPECT_EQ(duration(59.6), "1:00");
  EXPECT_EQ(duration(185), "3:05");
  EXPECT_EQ(duration(3725), "1:02:05");
}

TEST(Text, SizesAreInPowersOfAThousand) {
  EXPECT_EQ(byteSize(999), "999 B");
  EXPECT_EQ(byteSize(1536), "1.5 kB");
  EXPECT_EQ(byteSize(134517), "135 kB");
  EXPECT_EQ(byteSize(2457684), "2.5 MB");
}

TEST(Text, ExactNumbersReadBackAsTheSameDouble) {
  for (const double value : {0.1, 1.0 / 3, -2e-308, 1e300, 123456789.123456789, 0.0}) {
    EXPECT_EQ(std::strtod(exactNumber(value).c_str(), nullptr), value);
  }
  EXPECT_EQ(exactNumber(0.1), "0.1");
  EXPECT_EQ(exactNumber(std::numeric_limits<double>::quiet_NaN()), "nan");
}

TEST(Text, TablesAlignAndLeaveNoBlanksAtTheEnd) {
  EXPECT_EQ(table({{"a", "1", ""}, {"long", "100", "x"}}, {1}, " "), " a       1\n long  100  x\n");
}

TEST(Text, PointsMayBeSeparatedByCommasOrBlanks) {
  for (const char* text : {"1,-2.5,3e2", "1 -2.5 3e2", " 1,\t-2.5 , +3e2\r", "1.0,-2.50,300"}) {
    EXPECT_EQ(parsePoint(text), Vec3(1, -2.5, 300)) << text;
  }
}

TEST(Text, WhatIsNoPointIsRefusedAndQuoted) {
  for (const char* text : {"", "1", "1,2", "1,2,3,4", "1,2,x", "1,2,3x", "nan,0,0", "1,2,inf", "1,2,1e999",
                           "1;2;3", "0x10,2,3", "+-1,2,3", "--1,2,3"}) {
    try {
      parsePoint(text);
      FAIL() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage);
      EXPECT_NE(std::string(error.what()).find("\"" + std::string(text) + "\""), std::string::npos)
          << error.what();
    }
  }
}

}  // namespace
}  // namespace polestar::cli
