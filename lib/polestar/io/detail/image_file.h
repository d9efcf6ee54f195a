#pragma once
// The way of every picture into a file.

#include <OpenImageIO/imageio.h>

#include <filesystem>

#include "polestar/io/picture.h"

namespace polestar::detail {

/// @throws Error{Errc::usage} for a picture of no pixels or buffers of the wrong size.
void checkPicture(const Picture& picture);

/// The sRGB curve (IEC 61966-2-1): light of 0 and more -> code value.
float srgbFromLinear(float linear);

/// Writes `pixels`, values of `type` or the spec's native ones for UNKNOWN, under the name that OpenImageIO
/// has for the format; `text` and the name of this program are added to the metadata. Atomic.
/// @throws Error{Errc::io} with the reason.
void writeImage(const std::filesystem::path& path, const char* format, OIIO::ImageSpec spec,
                const PictureText& text, OIIO::TypeDesc type, const void* pixels);

}  // namespace polestar::detail
