#include "polestar/io/picture.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "polestar/core/error.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;

std::string fileBytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A folder of its own for every test, removed afterwards.
class PictureFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("polestar_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override {
    fs::permissions(folder_, fs::perms::owner_all);
    fs::remove_all(folder_);
  }
  std::size_t filesInFolder() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
};

Picture uniform(int width, int height, const Vec3f& color, float alpha = 1) {
  Picture picture(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float* pixel = picture.pixel(x, y);
      for (int c = 0; c < 3; ++c) pixel[c] = alpha * color[c];
      pixel[3] = alpha;
    }
  }
  return picture;
}

std::vector<std::uint8_t> readBack(const fs::path& path, OIIO::ImageSpec& spec) {
  const auto input = OIIO::ImageInput::open(path.string());
  EXPECT_TRUE(input) << OIIO::geterror();
  if (!input) return {};
  spec = input->spec();
  std::vector<std::uint8_t> bytes(spec.image_pixels() * spec.nchannels);
  EXPECT_TRUE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::UINT8, bytes.data()));
  return bytes;
}

TEST(DisplayValue, IsTheSrgbCurveBelowTheShoulder) {
  // Points of IEC 61966-2-1 computed by hand: its linear toe, and 0.214041 <-> 1/2.
  EXPECT_NEAR(displayValue(0.001f), 0.01292f, 1e-6);
  EXPECT_NEAR(displayValue(0.2140411f), 0.5f, 1e-5);
  EXPECT_EQ(displayValue(0), 0);
}

TEST(DisplayValue, RollsOffMonotonicallyAndSmoothly) {
  float previous = 0, previousSlope = 1e9f;
  for (int i = 1; i < 250; ++i) {
    const float value = displayValue(0.01f * static_cast<float>(i));
    EXPECT_GT(value, previous);
    const float slope = value - previous;
    EXPECT_LT(slope, 1.02f * previousSlope) << "kink at " << 0.01 * i;
    previousSlope = slope;
    previous = value;
  }
  EXPECT_LT(displayValue(3), 1);
  EXPECT_GT(displayValue(3), 0.99f);
  EXPECT_LE(displayValue(1e30f), 1);
}

TEST(DisplayValue, BadValuesAreBlack) {
  EXPECT_EQ(displayValue(-1), 0);
  EXPECT_EQ(displayValue(std::nanf("")), 0);
}

TEST(LinearFromSrgb, IsUndoneByTheDisplay) {
  // Below the shoulder every byte comes back.
  for (const std::uint32_t byte : {0u, 1u, 10u, 11u, 64u, 128u, 200u, 217u}) {
    const Vec3f linear = linearFromSrgb(byte << 8);
    EXPECT_EQ(std::lround(255 * displayValue(linear[1])), byte);
    EXPECT_EQ(linear[0], 0);
    EXPECT_EQ(linear[2], 0);
  }
}

TEST_F(PictureFile, HasTheColorsOfThePicture) {
  const Vec3f color = linearFromSrgb(0x4080c0);
  Picture picture = uniform(40, 30, color);
  // One pixel of another color tells rows from columns and up from down.
  for (int c = 0; c < 3; ++c) picture.pixel(7, 2)[c] = 0;
  writePicture(folder_ / "a.png", picture);
  OIIO::ImageSpec spec;
  const auto bytes = readBack(folder_ / "a.png", spec);
  EXPECT_EQ(spec.width, 40);
  EXPECT_EQ(spec.height, 30);
  ASSERT_EQ(spec.nchannels, 3);
  double sum[3] = {0, 0, 0};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (i / 3 == 2 * 40 + 7) {
      EXPECT_EQ(bytes[i], 0);
      continue;
    }
    const int expected[3] = {0x40, 0x80, 0xc0};
    EXPECT_NEAR(bytes[i], expected[i % 3], 1);
    sum[i % 3] += bytes[i];
  }
  // Dither is fair: the mean is the color to a small part of a step.
  EXPECT_NEAR(sum[0] / 1199, 0x40, 0.06);
  EXPECT_NEAR(sum[1] / 1199, 0x80, 0.06);
  EXPECT_NEAR(sum[2] / 1199, 0xc0, 0.06);
}

TEST_F(PictureFile, WritesStraightAlpha) {
  writePicture(folder_ / "a.png", uniform(8, 8, linearFromSrgb(0x4080c0), 0.5f));
  OIIO::ImageSpec spec;
  const auto input = OIIO::ImageInput::open((folder_ / "a.png").string());
  ASSERT_TRUE(input);
  // OpenImageIO premultiplies on reading unless told otherwise.
  OIIO::ImageSpec request;
  request.attribute("oiio:UnassociatedAlpha", 1);
  const auto straight = OIIO::ImageInput::open((folder_ / "a.png").string(), &request);
  ASSERT_TRUE(straight);
  ASSERT_EQ(straight->spec().nchannels, 4);
  std::vector<std::uint8_t> bytes(8 * 8 * 4);
  ASSERT_TRUE(straight->read_image(0, 0, 0, 4, OIIO::TypeDesc::UINT8, bytes.data()));
  EXPECT_NEAR(bytes[0], 0x40, 1);
  EXPECT_NEAR(bytes[1], 0x80, 1);
  EXPECT_NEAR(bytes[2], 0xc0, 1);
  EXPECT_EQ(bytes[3], 128);
}

TEST_F(PictureFile, CarriesText) {
  const std::string arguments = "polestar render head.vdb --cut x";
  writePicture(folder_ / "a.png", uniform(4, 4, {1, 0, 0}), {{"polestar:arguments", arguments}});
  OIIO::ImageSpec spec;
  readBack(folder_ / "a.png", spec);
  EXPECT_EQ(spec.get_string_attribute("polestar:arguments"), arguments);
  EXPECT_THAT(std::string(spec.get_string_attribute("Software")), ::testing::StartsWith("polestar "));
}

TEST_F(PictureFile, IsTheSameTwice) {
  const Picture picture = uniform(33, 17, {0.2f, 0.5f, 1.5f});
  writePicture(folder_ / "a.png", picture);
  writePicture(folder_ / "b.png", picture);
  EXPECT_EQ(fileBytes(folder_ / "a.png"), fileBytes(folder_ / "b.png"));
  EXPECT_THAT(fileBytes(folder_ / "a.png"), ::testing::StartsWith("\x89PNG"));
}

TEST_F(PictureFile, AppearsWholeOrNotAtAll) {
  const Picture picture = uniform(4, 4, {1, 1, 1});
  try {
    writePicture(folder_ / "missing" / "a.png", picture);
    FAIL() << "wrote into a folder that does not exist";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_THAT(error.what(), ::testing::HasSubstr("missing"));
  }
  // A folder in the way: the rename fails, and the temporary must not stay behind.
  fs::create_directories(folder_ / "taken.png" / "inside");
  try {
    writePicture(folder_ / "taken.png", picture);
    FAIL() << "replaced a folder";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
  }
  EXPECT_EQ(filesInFolder(), 1u);
  writePicture(folder_ / "a.png", picture);
  EXPECT_EQ(filesInFolder(), 2u);
}

TEST_F(PictureFile, RefusesWhatIsNoPicture) {
  Picture wrong(4, 4);
  wrong.rgba.pop_back();
  for (const Picture& picture : {Picture(), wrong}) {
    try {
      writePicture(folder_ / "a.png", picture);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage);
    }
  }
  EXPECT_EQ(filesInFolder(), 0u);
}

}  // namespace
}  // namespace polestar
