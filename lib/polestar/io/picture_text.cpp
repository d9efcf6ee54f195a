// readPictureText: what a picture says of its making.

#include <OpenImageIO/imageio.h>

#include <memory>

#include "polestar/core/error.h"
#include "polestar/io/picture.h"

namespace polestar {

PictureText readPictureText(const std::filesystem::path& path) {
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string());
  if (!input) throw Error(Errc::io, "cannot read " + path.string() + ": " + OIIO::geterror());
  const OIIO::ImageSpec& spec = input->spec();
  std::vector<unsigned char> pixels(spec.image_bytes(/*native=*/true));
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeUnknown, pixels.data()))
    throw Error(Errc::io, "cannot read " + path.string() + ": " + input->geterror());
  PictureText text;
  for (const OIIO::ParamValue& entry : spec.extra_attribs) {
    if (entry.type() == OIIO::TypeString) text.emplace_back(entry.name().string(), entry.get_string());
  }
  return text;
}

}  // namespace polestar
