#include "polestar/io/display_view.h"

#include <OpenImageIO/color.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cstdlib>

#include "polestar/core/error.h"

namespace polestar {
namespace {

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// `wanted`, or `standard` where that is empty, if it is among `names`.
std::string chosen(const std::string& wanted, const char* standard, const std::vector<std::string>& names,
                   const std::string& what) {
  const std::string name = wanted.empty() && standard ? standard : wanted;
  if (std::find(names.begin(), names.end(), name) != names.end()) return name;
  throw Error(Errc::usage, "the OpenColorIO configuration has no " + what + " \"" + name + "\"; it has " +
                               (names.empty() ? "none" : listed(names)));
}

}  // namespace

struct DisplayView::Transform {
  OIIO::ColorProcessorHandle processor;
};

bool DisplayView::configured() {
  const char* path = std::getenv("OCIO");
  return path && *path;
}

DisplayView::DisplayView(const std::string& display, const std::string& view) {
  if (!configured()) {
    throw Error(Errc::usage, "there is no OpenColorIO configuration; set OCIO to the path of one");
  }
  const std::string path = std::getenv("OCIO");
  OIIO::ColorConfig config(path);
  if (config.has_error()) {
    throw Error(Errc::io,
                "cannot read the OpenColorIO configuration " + path + " (from OCIO): " + config.geterror());
  }
  std::vector<std::string> displays, views;
  for (int i = 0; i < config.getNumDisplays(); ++i) displays.emplace_back(config.getDisplayNameByIndex(i));
  const std::string shown = chosen(display, config.getDefaultDisplayName(), displays, "display");
  for (int i = 0; i < config.getNumViews(shown); ++i) views.emplace_back(config.getViewNameByIndex(shown, i));
  const std::string seen = chosen(view, config.getDefaultViewName(shown), views, "view of " + shown);
  const auto processor = config.createDisplayTransform(shown, seen, "scene_linear");
  if (!processor) {
    throw Error(Errc::io, "the OpenColorIO configuration " + path + " cannot show scene_linear on " + shown +
                              " / " + seen + ": " + config.geterror());
  }
  name_ = shown + " / " + seen;
  transform_ = std::make_unique<Transform>(Transform{processor});
}

DisplayView::~DisplayView() = default;

std::vector<float> DisplayView::apply(const Picture& picture) const {
  std::vector<float> values = picture.rgba;
  const OIIO::ImageSpec spec(picture.width, picture.height, 4, OIIO::TypeDesc::FLOAT);
  // Straight colors go in and come out: a view is made for colors as they are seen.
  for (std::size_t i = 0; i < values.size(); i += 4) {
    const float alpha = values[i + 3];
    for (std::size_t c = 0; c < 3 && alpha < 1; ++c) values[i + c] = alpha > 0 ? values[i + c] / alpha : 0;
  }
  OIIO::ImageBuf buffer(spec, values.data());
  // One thread: this one may be inside a parallel stage.
  if (!OIIO::ImageBufAlgo::colorconvert(buffer, buffer, transform_->processor.get(), false, {}, 1))
    throw Error(Errc::io, "the view transform " + name_ + " failed: " + buffer.geterror());
  return values;
}

}  // namespace polestar
