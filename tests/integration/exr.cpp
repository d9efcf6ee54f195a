#include "integration/exr.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace polestar::test {
namespace {

template <class T>
std::vector<T> channel(OIIO::ImageInput& file, const std::string& name) {
  const OIIO::ImageSpec& spec = file.spec();
  const auto found = std::find(spec.channelnames.begin(), spec.channelnames.end(), name);
  if (found == spec.channelnames.end()) return {};
  const int index = static_cast<int>(found - spec.channelnames.begin());
  std::vector<T> values(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height));
  EXPECT_TRUE(file.read_image(0, 0, index, index + 1, OIIO::BaseTypeFromC<T>::value, values.data()))
      << file.geterror();
  return values;
}

}  // namespace

Exr readExr(const std::filesystem::path& path) {
  Exr picture;
  const auto file = OIIO::ImageInput::open(path.string());
  if (!file) {
    ADD_FAILURE() << OIIO::geterror();
    return picture;
  }
  picture.width = file->spec().width;
  picture.height = file->spec().height;
  const std::vector<float> red = channel<float>(*file, "R"), green = channel<float>(*file, "G"),
                           blue = channel<float>(*file, "B");
  for (std::size_t i = 0; i < red.size(); ++i) picture.color.emplace_back(red[i], green[i], blue[i]);
  picture.alpha = channel<float>(*file, "A");
  picture.depth = channel<float>(*file, "Z");
  picture.id = channel<std::uint32_t>(*file, "id");
  Picture::Camera camera;
  if (file->spec().getattribute("worldToCamera", OIIO::TypeMatrix44, camera.worldToCamera.data()) &&
      file->spec().getattribute("worldToScreen", OIIO::TypeMatrix44, camera.worldToScreen.data()))
    picture.camera = camera;
  return picture;
}

}  // namespace polestar::test
