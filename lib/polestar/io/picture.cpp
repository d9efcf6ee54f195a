#include "polestar/io/picture.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"

namespace polestar {
namespace {

constexpr float kShoulderStart = 0.7f;

float shoulder(float x) {
  if (x <= kShoulderStart) return x;
  constexpr float range = 1 - kShoulderStart;
  return kShoulderStart + range * (1 - std::exp(-(x - kShoulderStart) / range));
}

float srgbFromLinear(float x) {
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
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

std::vector<std::uint8_t> quantized(const Picture& picture, int channels) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(std::size_t{1} * channels * picture.width * picture.height);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const float* pixel = picture.pixel(x, y);
      const float alpha = pixel[3];
      for (int c = 0; c < 3; ++c) {
        // PNG wants straight color, and the view transform must see the color itself.
        const float color = channels == 3 ? pixel[c] : alpha > 0 ? pixel[c] / alpha : 0;
        bytes.push_back(quantize(displayValue(color), dither(x, y)));
      }
      if (channels == 4) bytes.push_back(quantize(std::clamp(alpha, 0.0f, 1.0f), 0));
    }
  }
  return bytes;
}

}  // namespace

float displayValue(float linear) {
  if (!(linear > 0)) return 0;
  return std::min(1.0f, srgbFromLinear(shoulder(linear)));
}

float linearFromSrgbValue(float code) {
  return code <= 0.04045f ? code / 12.92f : std::pow((code + 0.055f) / 1.055f, 2.4f);
}

Vec3f linearFromSrgb(std::uint32_t rgb) {
  return {linearFromSrgbValue(((rgb >> 16) & 255) / 255.0f), linearFromSrgbValue(((rgb >> 8) & 255) / 255.0f),
          linearFromSrgbValue((rgb & 255) / 255.0f)};
}

void writePicture(const std::filesystem::path& path, const Picture& picture, const PictureText& text) {
  const std::size_t pixels = std::size_t{1} * std::max(0, picture.width) * std::max(0, picture.height);
  if (pixels == 0 || picture.rgba.size() != 4 * pixels) {
    throw Error(Errc::usage, "picture of " + std::to_string(picture.width) + " x " +
                                 std::to_string(picture.height) + " pixels with " +
                                 std::to_string(picture.rgba.size()) + " values");
  }
  bool opaque = true;
  for (std::size_t i = 0; i < pixels && opaque; ++i) opaque = picture.rgba[4 * i + 3] >= 1;
  const int channels = opaque ? 3 : 4;
  const std::vector<std::uint8_t> bytes = quantized(picture, channels);

  OIIO::ImageSpec spec(picture.width, picture.height, channels, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("oiio:UnassociatedAlpha", 1);
  spec.attribute("Software", std::string("polestar ") + kVersion);
  for (const auto& [key, value] : text) spec.attribute(key, value);

  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    // By name: the temporary's extension says nothing about the format.
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("png");
    if (!output) throw Error(Errc::io, "cannot write " + path.string() + ": OpenImageIO has no PNG writer");
    if (!output->open(temporary.string(), spec) ||
        !output->write_image(OIIO::TypeDesc::UINT8, bytes.data()) || !output->close()) {
      throw Error(Errc::io, "cannot write " + path.string() + ": " + output->geterror());
    }
  });
}

}  // namespace polestar
