#include "polestar/io/frame_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polestar/core/error.h"

namespace polestar {
namespace {

using ::testing::ElementsAre;

TEST(FrameRange, IncludesBothEnds) {
  EXPECT_THAT(FrameRange::parse("1-4").frames(), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(FrameRange::parse("7").frames(), ElementsAre(7));
  EXPECT_THAT(FrameRange::parse("1-7x3").frames(), ElementsAre(1, 4, 7));
  EXPECT_THAT(FrameRange::parse("1-8x3").frames(), ElementsAre(1, 4, 7));
  EXPECT_THAT(FrameRange::parse("-2-1").frames(), ElementsAre(-2, -1, 0, 1));
  EXPECT_THAT(FrameRange::parse("-3--2").frames(), ElementsAre(-3, -2));
  EXPECT_EQ(FrameRange::parse("1-240x2").size(), 120U);
}

TEST(FrameRange, RefusesWhatIsNone) {
  for (const char* text :
       {"", "a", "1-", "1-4x", "4-1", "1-4x0", "1-4x-1", "1.5", "1 - 4", "1-4,6", "99999999"}) {
    try {
      FrameRange::parse(text);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage);
      EXPECT_THAT(error.what(), ::testing::HasSubstr(text));
    }
  }
}

TEST(FramePath, AllFormsOfPlaces) {
  EXPECT_EQ(FramePath("a/b.####.png").at(7), "a/b.0007.png");
  EXPECT_EQ(FramePath("a/b.%04d.png").at(7), "a/b.0007.png");
  EXPECT_EQ(FramePath("a/b.$F4.png").at(7), "a/b.0007.png");
  EXPECT_EQ(FramePath("b_%d.png").at(7), "b_7.png");
  EXPECT_EQ(FramePath("b_$F.png").at(7), "b_7.png");
  EXPECT_EQ(FramePath("b_##.png").at(12345), "b_12345.png");
  EXPECT_EQ(FramePath("b_####.png").at(-12), "b_-012.png");
  for (const char* text : {"b.#.png", "b.%02d.png", "b.$F3.png"})
    EXPECT_TRUE(FramePath(text).numbered()) << text;
}

TEST(FramePath, NamesWithoutAPlaceStayAsTheyAre) {
  // Folders are left alone, and a percent sign or a dollar alone is no place.
  for (const char* text : {"a.png", "c#/a.png", "100%.png", "$HOME/a.png", "a.%4d.png", "."}) {
    const FramePath path(text);
    EXPECT_FALSE(path.numbered()) << text;
    EXPECT_EQ(path.at(3), text);
  }
}

TEST(FramePath, OnePlaceOnly) {
  for (const char* text : {"a##.##.png", "a.#.%d.png", "$F4_####.vdb"})
    EXPECT_THROW(FramePath{text}, Error) << text;
}

}  // namespace
}  // namespace polestar
