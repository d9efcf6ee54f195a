#include "polestar/polycube/polycube_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "polestar/core/error.h"
#include "random_polycube.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

void expectRefused(const std::string& text, Errc code, const std::string& reason) {
  SCOPED_TRACE(text);
  try {
    polycubeFromText(text, "hand.txt");
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("hand.txt"), HasSubstr(reason)));
  }
}

TEST(PolycubeText, MetadataIsReadToo) {
  EXPECT_EQ(polycubeFromText("0 0 0;1:2 0 0; 0 0 -1"), polycubeFromText("0 0 0\n1:2 0 0\n0 0 -1\n"));
  EXPECT_THROW(polycubeFromText("0 0 0;2 0 0"), Error);
}

TEST(PolycubeText, BoxesOfCellsMayOverlap) {
  const Polycube cross = polycubeFromText(
      "# three bars\r\n"
      "-2:2 0 0\n"
      "\n"
      "   0\t-1:+1 0   # the second\n"
      "0 0 -1:1");
  EXPECT_EQ(cross, verifyPolycube({{-2, 0, 0},
                                   {-1, 0, 0},
                                   {0, 0, 0},
                                   {1, 0, 0},
                                   {2, 0, 0},
                                   {0, -1, 0},
                                   {0, 1, 0},
                                   {0, 0, -1},
                                   {0, 0, 1}}));
}

TEST(PolycubeText, RoundTrip) {
  EXPECT_EQ(toText(cubeDomain()), "0 0 0\n");
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Polycube polycube = testing::randomPolycube({{-4, -4, -4}, {4, 4, 4}}, 60, seed);
    EXPECT_EQ(polycubeFromText(toText(polycube)), polycube);
  }
}

TEST(PolycubeText, FilesRoundTrip) {
  const test::ScratchFolder folder;
  const auto path = folder / "cells.txt";
  const Polycube polycube = testing::randomPolycube({{-2, -2, -2}, {2, 2, 2}}, 20, 3);
  writePolycube(path, polycube);
  EXPECT_EQ(readPolycube(path), polycube);
}

TEST(PolycubeText, ErrorsNameTheLine) {
  expectRefused("0 0 0\n1 0\n", Errc::io, "line 2: three numbers");
  expectRefused("0 0 0\n\n1 0 0 0\n", Errc::io, "line 3: more than three");
  expectRefused("0 0 zero\n", Errc::io, "line 1: 'zero'");
  expectRefused("0 0 1.5\n", Errc::io, "line 1: '1.5'");
  expectRefused("0 0 1:\n", Errc::io, "line 1: ''");
  expectRefused("0 0 2:-2\n", Errc::io, "runs backwards");
  expectRefused("0 0 -65:0\n", Errc::io, "'-65' is farther than 64");
  expectRefused("0 0 99999999999999999999\n", Errc::io, "line 1");
  expectRefused(std::string("0 0 \1\n"), Errc::io, "'?'");
}

TEST(PolycubeText, WhatIsNotStarShapedIsRefusedLikeAnyList) {
  expectRefused("", Errc::notStarShaped, "no cell");
  expectRefused("# nothing\n", Errc::notStarShaped, "no cell");
  expectRefused("1 0 0\n", Errc::notStarShaped, "cell 0 0 0");
  expectRefused("0 0 0\n2 0 0\n", Errc::notStarShaped, "2 0 0 needs 1 0 0");
}

TEST(PolycubeText, FilesThatCannotBeReadAreNamed) {
  const test::ScratchFolder folder;
  EXPECT_THROW(readPolycube(folder / "missing.txt"), Error);
  EXPECT_THROW(readPolycube(folder.path()), Error);
}

}  // namespace
}  // namespace polestar
