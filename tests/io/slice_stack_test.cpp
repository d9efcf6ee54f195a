// Stacks of slices: their places and colors, and what is wrong with some.
#include "polestar/io/slice_stack.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "polestar/core/error.h"
#include "polestar/io/picture.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;

class SliceStack : public ::testing::Test {
 protected:
  /// A pixel's code tells its place: red the column, green the row from above, blue the slice.
  void write(const std::string& name, int width, int height, int slice, int channels = 3,
             OIIO::TypeDesc type = OIIO::TypeDesc::UINT8) {
    std::vector<float> pixels;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const float code[4] = {static_cast<float>(10 * x) / 255, static_cast<float>(10 * y) / 255,
                               static_cast<float>(10 * slice) / 255, x == 0 ? 0.0f : 1.0f};
        for (int c = 0; c < channels; ++c) pixels.push_back(channels == 2 && c == 1 ? code[3] : code[c]);
      }
    }
    OIIO::ImageSpec spec(width, height, channels, type);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    const auto output = OIIO::ImageOutput::create((folder_ / name).string());
    ASSERT_TRUE(output && output->open((folder_ / name).string(), spec));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    output->close();
  }
  std::string refusal(const std::string& pattern, Errc code = Errc::io) {
    try {
      readSlices(folder_ / pattern);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code) << error.what();
      return error.what();
    }
    return "";
  }

  test::ScratchFolder folder_;
};

TEST_F(SliceStack, PutsPixelsWhereTheyBelong) {
  for (int slice = 8; slice <= 11; ++slice)
    write("s." + std::string(slice < 10 ? "0" : "") + std::to_string(slice) + ".png", 5, 4, slice);
  const SampledGrids grids =
      readSlices(folder_ / "s.##.png", {.voxelSize = Vec3(0.5, 0.25, 2), .origin = Vec3(100, 10, 1)});
  const SampledGrid* color = grids.find("Cd", true);
  ASSERT_NE(color, nullptr);
  EXPECT_EQ(color->activeVoxels(), 5U * 4U * 4U);
  EXPECT_EQ(grids.find("density", false), nullptr);
  // Column 3, row 1 from above, slice 10.
  const Vec3 place(100 + 0.5 * 3.5, 10 + 0.25 * 2.5, 1 + 2 * 2.5);
  Vec3f value;
  float weight = 0;
  color->sample({&place, 1}, {}, {&value, 1}, {&weight, 1});
  const Vec3f expected(linearFromSrgbValue(30 / 255.0f), linearFromSrgbValue(10 / 255.0f),
                       linearFromSrgbValue(100 / 255.0f));
  EXPECT_LT((value - expected).norm(), 1e-5);
  EXPECT_NEAR(weight, 1, 1e-5);
}

TEST_F(SliceStack, AlphaSaysWhereTheBodyIs) {
  for (int slice = 0; slice < 3; ++slice) write("a" + std::to_string(slice) + ".png", 4, 4, slice, 4);
  const SampledGrids grids = readSlices(folder_ / "a%d.png");
  EXPECT_EQ(grids.find("Cd", true)->activeVoxels(), 3U * 4U * 3U);
  ASSERT_NE(grids.find("density", false), nullptr);
  EXPECT_TRUE(grids.extractSurface());
}

TEST_F(SliceStack, FloatsAreLightAlready) {
  for (int slice = 0; slice < 2; ++slice)
    write("e" + std::to_string(slice) + ".exr", 4, 4, slice, 3, OIIO::TypeDesc::FLOAT);
  const SampledGrids grids = readSlices(folder_ / "e$F1.exr");
  const Vec3 place(3.5, 3.5, 0.5);
  Vec3f value;
  float weight = 0;
  grids.find("Cd", true)->sample({&place, 1}, {}, {&value, 1}, {&weight, 1});
  EXPECT_NEAR(value.x(), 30 / 255.0f, 1e-6);
}

TEST_F(SliceStack, SaysWhatIsMissingOrUnequal) {
  for (const int slice : {1, 2, 5, 6}) write("m." + std::to_string(slice) + ".png", 4, 4, slice);
  EXPECT_THAT(refusal("m.#.png"), AllOf(HasSubstr("3, 4"), HasSubstr("missing")));
  write("u.1.png", 4, 4, 1);
  write("u.2.png", 4, 5, 2);
  EXPECT_THAT(refusal("u.#.png"), AllOf(HasSubstr("u.2.png"), HasSubstr("4 x 5"), HasSubstr("alike")));
  EXPECT_THAT(refusal("none.#.png"), HasSubstr("no file"));
  std::ofstream(folder_ / "b.1.png") << "no picture";
  std::ofstream(folder_ / "b.2.png") << "no picture";
  EXPECT_THAT(refusal("b.#.png"), HasSubstr("b.1.png"));
  EXPECT_THAT(refusal("plain.png", Errc::usage), HasSubstr("####"));
}

}  // namespace
}  // namespace polestar
