#pragma once
// Pictures out. A picture is scene-linear light until the moment it is written; the view transform that makes
// it fit a display lives here, in one place.

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "polestar/core/types.h"

namespace polestar {

/// One more number a pixel, under a name that compositing programs group by: "N.x", "Z".
struct PictureChannel {
  enum class Format { half, full, integer };  ///< as stored: 16 or 32 bit floats, unsigned 32 bit integers
  std::string name;
  Format format = Format::full;
  std::vector<float> values;  ///< width * height
};

/// Scene-linear, premultiplied RGBA with Rec. 709 primaries; rows from the top, pixels from the left.
struct Picture {
  int width = 0, height = 0;
  int x0 = 0, y0 = 0;  ///< where the first pixel lies in the full picture, of which this is a part
  int fullWidth = 0, fullHeight = 0;  ///< of the full picture; 0: this is all of it
  std::vector<float> rgba;            ///< 4 * width * height
  std::vector<PictureChannel> channels;
  /// Where the camera stood: row vectors times matrices, row by row, as OpenEXR has them. The camera looks
  /// along +z, x to the right, y up; the screen spans -1 to 1.
  struct Camera {
    std::array<float, 16> worldToCamera{}, worldToScreen{};
  };
  std::optional<Camera> camera;

  Picture() = default;
  /// Black and transparent.
  Picture(int widthPixels, int heightPixels)
      : width(widthPixels), height(heightPixels), rgba(std::size_t{4} * widthPixels * heightPixels) {}

  float* pixel(int x, int y) { return &rgba[4 * (std::size_t{1} * y * width + x)]; }
  const float* pixel(int x, int y) const { return &rgba[4 * (std::size_t{1} * y * width + x)]; }
};

/// Pictures of one height from left to right, their colors alone: each had a camera of its own. A single one
/// stays as it is.
/// @throws Error{Errc::usage} for none, or different heights.
Picture sideBySide(std::vector<Picture> pictures);

/// Key and value, written as text chunks; keys of at most 79 Latin-1 characters.
using PictureText = std::vector<std::pair<std::string, std::string>>;

class DisplayView;

/// The view transform, per channel: scene-linear light -> sRGB code value in [0, 1].
///
/// Identity up to 0.7, above it an exponential shoulder 0.7 + 0.3 (1 - exp(-(x - 0.7) / 0.3)), continuous
/// with its first derivative and approaching 1; then the sRGB curve (IEC 61966-2-1). So a palette's colors
/// come out as given where the light is even, and highlights roll off instead of clipping. NaN and negative
/// values give 0.
float displayValue(float linear);

/// Inverse of the sRGB curve (IEC 61966-2-1): code value in [0, 1] -> light.
float linearFromSrgbValue(float code);

/// "#rrggbb" (0xrrggbb) as scene-linear color.
Vec3f linearFromSrgb(std::uint32_t rgb);

/// Writes an 8-bit PNG through the view transform, or through `display`, if there is one, with a fixed
/// pattern of +-1/2 step dither against bands in soft gradients; RGB when every pixel is opaque, else RGBA.
/// The same picture gives the same bytes. `text` gets "Software" added. Atomic: the file appears whole or not
/// at all.
/// @throws Error{Errc::usage} for a picture of no pixels or a buffer of the wrong size; Error{Errc::io} with
/// the reason when it cannot be written.
void writePicture(const std::filesystem::path& path, const Picture& picture, const PictureText& text = {},
                  const DisplayView* display = nullptr);

/// Writes a tiled OpenEXR file, scene-linear: colors and alpha as halfs, the picture's channels in their own
/// formats, its place in the full picture as data window, its camera and `text` as metadata. Atomic, the same
/// bytes for the same picture, as a PNG.
/// @throws as writePicture.
void writeExr(const std::filesystem::path& path, const Picture& picture, const PictureText& text = {});

/// The text entries of a picture file of any format, "Software" among them, after all of its pixels were
/// decoded: of a damaged or truncated file there are none.
/// @throws Error{Errc::io}
PictureText readPictureText(const std::filesystem::path& path);

/// What writeExr's file takes at most: pixels are not compressed. Of writePicture's, the same for 8 bits a
/// value.
std::size_t largestExrBytes(const Picture& picture);
std::size_t largestPngBytes(const Picture& picture);

}  // namespace polestar
