// Sheets of pictures, and what pictures say of themselves.

#include "polestar/io/contact_sheet.h"

#include <OpenImageIO/imagebuf.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polestar/core/error.h"
#include "polestar/io/detail/text_raster.h"
#include "polestar/io/picture.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::Contains;
using ::testing::Pair;

Picture plain(int width, int height, const Vec3f& color) {
  Picture picture(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) picture.pixel(x, y)[c] = color[c];
      picture.pixel(x, y)[3] = 1;
    }
  }
  return picture;
}

class ContactSheetTest : public ::testing::Test {
 protected:
  /// Where a color lies on the sheet: the mean of its pixels.
  static Vec3 middleOf(const std::filesystem::path& path, const Vec3f& color) {
    OIIO::ImageBuf sheet(path.string());
    EXPECT_TRUE(sheet.read(0, 0, true, OIIO::TypeDesc::FLOAT));
    Vec3 sum = Vec3::Zero();
    for (OIIO::ImageBuf::ConstIterator<float> p(sheet); !p.done(); ++p) {
      if ((Vec3f(p[0], p[1], p[2]) - color).cwiseAbs().maxCoeff() < 0.03F) sum += Vec3(p.x(), p.y(), 1);
    }
    return sum / std::max(1.0, sum.z()) + Vec3(0, 0, sum.z() - 1);
  }

  test::ScratchFolder folder_;
};

TEST_F(ContactSheetTest, PicturesStandInTheirRowsAndColumns) {
  writePicture(folder_ / "red.png", plain(40, 30, {1, 0, 0}));
  writeExr(folder_ / "green.exr", plain(80, 60, {0, 0.5F, 0}));
  ContactSheet sheet;
  sheet.rows = {"kiwi", "größe"};
  sheet.columns = {"a", "b"};
  sheet.cells = {{folder_ / "red.png", ""}, {"", "failed"}, {"", "failed"}, {folder_ / "green.exr", ""}};
  sheet.cellWidth = 100;
  EXPECT_TRUE(writeContactSheet(folder_ / "sheet.png", sheet));
  const Vec3 red = middleOf(folder_ / "sheet.png", {displayValue(1), 0, 0});
  const Vec3 green = middleOf(folder_ / "sheet.png", {0, displayValue(0.5F), 0});
  // A cell is 100 x 75 pixels, and the second follows the first after a gap of 6.
  EXPECT_NEAR(red.z(), 7500, 1000);
  EXPECT_NEAR(green.z(), 7500, 1000);
  EXPECT_NEAR(green.x() - red.x(), 106, 2);
  EXPECT_NEAR(green.y() - red.y(), 81, 2);
}

TEST_F(ContactSheetTest, WhatCannotBeReadOrWrittenIsSaid) {
  ContactSheet sheet;
  sheet.rows = {""};
  sheet.columns = {""};
  EXPECT_THROW(writeContactSheet(folder_ / "sheet.png", sheet), Error);
  sheet.cells = {{folder_ / "none.png", ""}};
  EXPECT_THROW(writeContactSheet(folder_ / "sheet.png", sheet), Error);
  sheet.cells = {{"", "nothing"}};
  EXPECT_THROW(writeContactSheet(folder_ / "sheet.gif", sheet), Error);
  EXPECT_EQ(folder_.entries(), 0U);
  EXPECT_TRUE(writeContactSheet(folder_ / "sheet.jpg", sheet));
}

TEST(TextRaster, LettersOfAllScriptsAreDrawnAndCut) {
  const detail::TextRaster raster(16);
  ASSERT_TRUE(raster.hasFont()) << "install fonts-dejavu-core";
  // Letters that differ do so in pixels, too: no replacement boxes.
  EXPECT_NE(raster.draw("ö").coverage, raster.draw("ß").coverage);
  EXPECT_NE(raster.draw("ö").coverage, raster.draw("Ж").coverage);
  EXPECT_EQ(raster.width("größe"), raster.width("gr") + raster.width("ö") + raster.width("ße"));
  EXPECT_EQ(raster.cut("größe", 500), "größe");
  const std::string cut = raster.cut("größe größe größe", 80);
  EXPECT_LE(raster.width(cut), 80);
  EXPECT_TRUE(cut.starts_with("größe"));
  EXPECT_TRUE(cut.ends_with("…"));
  // Bytes that are no UTF-8 end nothing.
  EXPECT_GT(raster.width("a\xC3"), raster.width("a"));
}

TEST_F(ContactSheetTest, PicturesSayWhatMadeThem) {
  const PictureText text{{"polestar:arguments", "polestar render 'größe.vdb'"}};
  writePicture(folder_ / "a.png", plain(8, 8, {1, 0, 0}), text);
  writeExr(folder_ / "a.exr", plain(8, 8, {1, 0, 0}), text);
  for (const char* name : {"a.png", "a.exr"})
    EXPECT_THAT(readPictureText(folder_ / name),
                Contains(Pair("polestar:arguments", "polestar render 'größe.vdb'")))
        << name;
  const std::string whole = test::bytesOf(folder_ / "a.png");
  for (const std::size_t size : {whole.size() / 2, whole.size() - 20, std::size_t{0}}) {
    test::writeBytes(folder_ / "cut.png", whole.substr(0, size));
    EXPECT_THROW(readPictureText(folder_ / "cut.png"), Error) << size;
  }
}

}  // namespace
}  // namespace polestar
