#include "polestar/io/picture.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>

#include <OpenImageIO/filesystem.h>

#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/io/detail/image_file.h"
#include "polestar/io/display_view.h"

namespace polestar {
namespace {

constexpr float kShoulderStart = 0.7f;

float shoulder(float x) {
  if (x <= kShoulderStart) return x;
  constexpr float range = 1 - kShoulderStart;
  return kShoulderStart + range * (1 - std::exp(-(x - kShoulderStart) / range));
}

/// Ordered dither in (-1/2, 1/2): the fractional parts of a plane with golden-ratio-like slopes, whose errors
/// lie at high spatial frequencies.
float dither(int x, int y) {
  const double value = 0.7548776662466927 * x + 0.5698402909980532 * y;
  return static_cast<float>(value - std::floor(value)) - 0.5f;
}

std::uint8_t quantize(float displayed, float offset) {
  // Black and white stay exact.
  if (displayed <= 0) return 0;
  return static_cast<std::uint8_t>(std::clamp(std::floor(255 * displayed + 0.5f + offset), 0.0f, 255.0f));
}

/// Straight RGBA code values in [0, 1], alpha as it is.
std::vector<float> displayed(const Picture& picture) {
  std::vector<float> values = picture.rgba;
  for (std::size_t i = 0; i < values.size(); i += 4) {
    const float alpha = values[i + 3];
    // PNG wants straight color, and the view transform must see the color itself.
    for (std::size_t c = 0; c < 3; ++c)
      values[i + c] = displayValue(alpha >= 1 ? values[i + c] : alpha > 0 ? values[i + c] / alpha : 0);
  }
  return values;
}

std::vector<std::uint8_t> quantized(const std::vector<float>& values, int width, std::size_t channels) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(values.size() / 4 * channels);
  for (std::size_t i = 0; i < values.size() / 4; ++i) {
    const float offset = dither(static_cast<int>(i) % width, static_cast<int>(i) / width);
    for (std::size_t c = 0; c < 3; ++c) bytes.push_back(quantize(values[4 * i + c], offset));
    if (channels == 4) bytes.push_back(quantize(std::clamp(values[4 * i + 3], 0.0f, 1.0f), 0));
  }
  return bytes;
}

}  // namespace

Picture sideBySide(std::vector<Picture> pictures) {
  if (pictures.empty()) throw Error(Errc::usage, "no pictures to put side by side");
  if (pictures.size() == 1) return std::move(pictures.front());
  int width = 0;
  for (const Picture& picture : pictures) {
    if (picture.height != pictures.front().height)
      throw Error(Errc::usage, "pictures side by side must have one height");
    width += picture.width;
  }
  Picture row(width, pictures.front().height);
  int x = 0;
  for (const Picture& picture : pictures) {
    for (int y = 0; y < row.height; ++y)
      std::copy_n(picture.pixel(0, y), std::size_t{4} * picture.width, row.pixel(x, y));
    x += picture.width;
  }
  return row;
}

float displayValue(float linear) {
  if (!(linear > 0)) return 0;
  return std::min(1.0f, detail::srgbFromLinear(shoulder(linear)));
}

float linearFromSrgbValue(float code) {
  return code <= 0.04045f ? code / 12.92f : std::pow((code + 0.055f) / 1.055f, 2.4f);
}

Vec3f linearFromSrgb(std::uint32_t rgb) {
  return {linearFromSrgbValue(((rgb >> 16) & 255) / 255.0f), linearFromSrgbValue(((rgb >> 8) & 255) / 255.0f),
          linearFromSrgbValue((rgb & 255) / 255.0f)};
}

void writePicture(const std::filesystem::path& path, const Picture& picture, const PictureText& text,
                  const DisplayView* display) {
  detail::checkPicture(picture);
  bool opaque = true;
  for (std::size_t i = 3; i < picture.rgba.size() && opaque; i += 4) opaque = picture.rgba[i] >= 1;
  const int channels = opaque ? 3 : 4;
  const std::vector<std::uint8_t> bytes = quantized(display ? display->apply(picture) : displayed(picture),
                                                    picture.width, static_cast<std::size_t>(channels));

  OIIO::ImageSpec spec(picture.width, picture.height, channels, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", display ? display->name() : "sRGB");
  spec.attribute("oiio:UnassociatedAlpha", 1);
  detail::writeImage(path, "png", spec, text, OIIO::TypeDesc::UINT8, bytes.data());
}

std::size_t largestPngBytes(const Picture& picture) {
  // Deflate stores what it cannot shorten, with a little around it.
  const auto pixels = static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  return 4 * pixels + pixels / 500 + static_cast<std::size_t>(picture.height) + 65536;
}

namespace detail {

float srgbFromLinear(float x) {
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

void checkPicture(const Picture& picture) {
  const std::size_t pixels = std::size_t{1} * std::max(0, picture.width) * std::max(0, picture.height);
  bool right = pixels > 0 && picture.rgba.size() == 4 * pixels;
  for (const PictureChannel& channel : picture.channels) right = right && channel.values.size() == pixels;
  if (right) return;
  throw Error(Errc::usage, "picture of " + std::to_string(picture.width) + " x " +
                               std::to_string(picture.height) + " pixels with " +
                               std::to_string(picture.rgba.size()) + " values");
}

void writeImage(const std::filesystem::path& path, const char* format, OIIO::ImageSpec spec,
                const PictureText& text, OIIO::TypeDesc type, const void* pixels) {
  spec.attribute("Software", std::string("polestar ") + kVersion);
  for (const auto& [key, value] : text) spec.attribute(key, value);
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    // By name: the temporary's extension says nothing about the format.
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(format);
    if (!output) {
      throw Error(Errc::io,
                  "cannot write " + path.string() + ": OpenImageIO has no writer for " + std::string(format));
    }
    // In memory first, where the format allows: a full disk is what OpenImageIO does not notice.
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const bool inMemory = output->supports("ioproxy") && output->set_ioproxy(&memory);
    if (!output->open(temporary.string(), spec) || !output->write_image(type, pixels) || !output->close()) {
      throw Error(Errc::io, "cannot write " + path.string() + ": " + output->geterror());
    }
    if (!inMemory) return;
    std::ofstream out(temporary, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) throw Error(Errc::io, "cannot write " + path.string() + ": the disk may be full");
  });
}

}  // namespace detail

}  // namespace polestar
