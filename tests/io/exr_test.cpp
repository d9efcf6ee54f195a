// Pictures for compositing, read back by OpenImageIO.

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "polestar/core/error.h"
#include "polestar/io/picture.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;
using Format = PictureChannel::Format;

/// A part of a picture of 200 x 150 pixels, each value different from its neighbours'.
Picture picture() {
  Picture result(97, 70);
  result.x0 = 40;
  result.y0 = 30;
  result.fullWidth = 200;
  result.fullHeight = 150;
  for (std::size_t i = 0; i < result.rgba.size(); ++i) result.rgba[i] = static_cast<float>(i % 1000) / 64;
  const std::size_t pixels = result.rgba.size() / 4;
  for (const auto& [name, format] :
       {std::pair{"Z", Format::full}, {"N.x", Format::half}, {"id", Format::integer}}) {
    PictureChannel channel{name, format, std::vector<float>(pixels)};
    for (std::size_t i = 0; i < pixels; ++i)
      channel.values[i] = static_cast<float>(i) + (format == Format::full ? 0.1f : 0);
    if (format == Format::half)
      for (float& v : channel.values) v = std::sin(v);
    result.channels.push_back(channel);
  }
  result.camera.emplace();
  for (int i = 0; i < 16; ++i) result.camera->worldToCamera[i] = static_cast<float>(i) / 3;
  return result;
}

TEST(Exr, ReadsBackInItsOwnFormats) {
  const test::ScratchFolder folder;
  const Picture written = picture();
  writeExr(folder / "a.exr", written, {{"polestar:arguments", "polestar render x"}});
  const auto input = OIIO::ImageInput::open((folder / "a.exr").string());
  ASSERT_TRUE(input) << OIIO::geterror();
  const OIIO::ImageSpec spec = input->spec();
  EXPECT_EQ(spec.width, 97);
  EXPECT_EQ(spec.height, 70);
  EXPECT_EQ(spec.x, 40);
  EXPECT_EQ(spec.y, 30);
  EXPECT_EQ(spec.full_width, 200);
  EXPECT_EQ(spec.full_height, 150);
  EXPECT_GT(spec.tile_width, 0);
  EXPECT_EQ(spec.get_string_attribute("polestar:arguments"), "polestar render x");
  float matrix[16];
  ASSERT_TRUE(spec.getattribute("worldtocamera", OIIO::TypeMatrix44, matrix));
  EXPECT_EQ(matrix[5], 5.0f / 3);

  std::map<std::string, OIIO::TypeDesc> formats;
  std::map<std::string, int> index;
  for (int c = 0; c < spec.nchannels; ++c) {
    formats[spec.channelnames[c]] = spec.channelformat(c);
    index[spec.channelnames[c]] = c;
  }
  EXPECT_EQ(formats["R"], OIIO::TypeDesc::HALF);
  EXPECT_EQ(formats["A"], OIIO::TypeDesc::HALF);
  EXPECT_EQ(formats["Z"], OIIO::TypeDesc::FLOAT);
  EXPECT_EQ(formats["N.x"], OIIO::TypeDesc::HALF);
  EXPECT_EQ(formats["id"], OIIO::TypeDesc::UINT32);

  const auto n = static_cast<std::size_t>(spec.nchannels);
  std::vector<float> floats(spec.image_pixels() * n);
  ASSERT_TRUE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, floats.data()));
  std::vector<std::uint32_t> ids(spec.image_pixels());
  ASSERT_TRUE(input->read_image(0, 0, index["id"], index["id"] + 1, OIIO::TypeDesc::UINT32, ids.data()));
  for (std::size_t i = 0; i < spec.image_pixels(); ++i) {
    EXPECT_EQ(floats[n * i + index["R"]], written.rgba[4 * i]);  // sixty-fourths are halfs
    EXPECT_EQ(floats[n * i + index["A"]], written.rgba[4 * i + 3]);
    EXPECT_EQ(floats[n * i + index["Z"]], written.channels[0].values[i]);
    EXPECT_NEAR(floats[n * i + index["N.x"]], written.channels[1].values[i], 5e-4);
    EXPECT_EQ(ids[i], i);
  }
}

TEST(Exr, IsTheSameTwiceAndNoLargerThanPromised) {
  const test::ScratchFolder folder;
  writeExr(folder / "a.exr", picture());
  writeExr(folder / "b.exr", picture());
  EXPECT_EQ(test::bytesOf(folder / "a.exr"), test::bytesOf(folder / "b.exr"));
  // Noise cannot be compressed.
  Picture noise = picture();
  std::uint32_t state = 1;
  for (std::vector<float>* values : {&noise.rgba, &noise.channels[0].values, &noise.channels[2].values}) {
    for (float& value : *values) value = static_cast<float>((state = state * 1664525 + 1013904223) >> 8);
  }
  writeExr(folder / "c.exr", noise);
  EXPECT_LE(fs::file_size(folder / "c.exr"), largestExrBytes(noise));
  writePicture(folder / "c.png", noise);
  EXPECT_LE(fs::file_size(folder / "c.png"), largestPngBytes(noise));
}

TEST(Exr, ValuesThatHalfsCannotHold) {
  const test::ScratchFolder folder;
  Picture bright(2, 1);
  bright.rgba = {1e9f, -1e9f, std::numeric_limits<float>::quiet_NaN(), 1, 0, 0, 0, 1};
  writeExr(folder / "a.exr", bright);
  const auto input = OIIO::ImageInput::open((folder / "a.exr").string());
  ASSERT_TRUE(input);
  float values[8];
  ASSERT_TRUE(input->read_image(0, 0, 0, 4, OIIO::TypeDesc::FLOAT, values));
  EXPECT_EQ(values[0], 65504);
  EXPECT_EQ(values[1], -65504);
  EXPECT_TRUE(std::isnan(values[2]));
}

TEST(Exr, RefusesChannelsOfTheWrongSize) {
  const test::ScratchFolder folder;
  Picture wrong = picture();
  wrong.channels[1].values.pop_back();
  EXPECT_THROW(writeExr(folder / "a.exr", wrong), Error);
  EXPECT_FALSE(fs::exists(folder / "a.exr"));
}

}  // namespace
}  // namespace polestar
