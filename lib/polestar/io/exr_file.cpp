// Pictures for compositing.

#include <OpenImageIO/half.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "polestar/io/detail/image_file.h"
#include "polestar/io/picture.h"

namespace polestar {
namespace {

constexpr int kTileSize = 64;
constexpr float kLargestHalf = 65504;

std::size_t bytesOf(PictureChannel::Format format) { return format == PictureChannel::Format::half ? 2 : 4; }

std::size_t bytesOfPixel(const Picture& picture) {
  std::size_t bytes = 4 * sizeof(half);
  for (const PictureChannel& channel : picture.channels) bytes += bytesOf(channel.format);
  return bytes;
}

void put(std::byte*& to, PictureChannel::Format format, float value) {
  if (format == PictureChannel::Format::half) {
    const half stored(std::isnan(value) ? value : std::clamp(value, -kLargestHalf, kLargestHalf));
    std::memcpy(to, &stored, sizeof stored);
  } else if (format == PictureChannel::Format::full) {
    std::memcpy(to, &value, sizeof value);
  } else {
    const auto stored = static_cast<std::uint32_t>(std::max(0.0f, value));
    std::memcpy(to, &stored, sizeof stored);
  }
  to += bytesOf(format);
}

OIIO::ImageSpec exrSpec(const Picture& picture) {
  OIIO::ImageSpec spec(picture.width, picture.height, static_cast<int>(4 + picture.channels.size()),
                       OIIO::TypeDesc::HALF);
  spec.x = picture.x0;
  spec.y = picture.y0;
  spec.full_width = picture.fullWidth > 0 ? picture.fullWidth : picture.width;
  spec.full_height = picture.fullHeight > 0 ? picture.fullHeight : picture.height;
  spec.tile_width = spec.tile_height = kTileSize;
  spec.channelnames = {"R", "G", "B", "A"};
  spec.channelformats.assign(4, OIIO::TypeDesc::HALF);
  for (const PictureChannel& channel : picture.channels) {
    spec.channelnames.push_back(channel.name);
    using Format = PictureChannel::Format;
    spec.channelformats.push_back(channel.format == Format::half   ? OIIO::TypeDesc::HALF
                                  : channel.format == Format::full ? OIIO::TypeDesc::FLOAT
                                                                   : OIIO::TypeDesc::UINT32);
  }
  spec.attribute("compression", "zip");
  // The same bytes for the same picture: without a date the writer takes the clock's.
  spec.attribute("DateTime", "1970:01:01 00:00:00");
  spec.attribute("oiio:ColorSpace", "Linear");
  const float rec709[] = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
  spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), rec709);
  if (picture.camera) {
    spec.attribute("worldtocamera", OIIO::TypeMatrix44, picture.camera->worldToCamera.data());
    spec.attribute("worldtoscreen", OIIO::TypeMatrix44, picture.camera->worldToScreen.data());
  }
  return spec;
}

}  // namespace

void writeExr(const std::filesystem::path& path, const Picture& picture, const PictureText& text) {
  detail::checkPicture(picture);
  const std::size_t pixels = picture.rgba.size() / 4;
  std::vector<std::byte> bytes(pixels * bytesOfPixel(picture));
  std::byte* to = bytes.data();
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 4; ++c) put(to, PictureChannel::Format::half, picture.rgba[4 * i + c]);
    for (const PictureChannel& channel : picture.channels) put(to, channel.format, channel.values[i]);
  }
  detail::writeImage(path, "openexr", exrSpec(picture), text, OIIO::TypeDesc::UNKNOWN, bytes.data());
}

std::size_t largestExrBytes(const Picture& picture) {
  const auto tiles = [](int pixels) {
    return static_cast<std::size_t>((pixels + kTileSize - 1) / kTileSize);
  };
  const std::size_t count = tiles(picture.width) * tiles(picture.height);
  return static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height) *
             bytesOfPixel(picture) +
         64 * count + 65536;
}

}  // namespace polestar
