#pragma once
// A studio's own view transform: what an OpenColorIO configuration has for a display. A facade: OpenImageIO
// stays in the .cpp.

#include <memory>
#include <string>
#include <vector>

#include "polestar/io/picture.h"

namespace polestar {

class DisplayView {
 public:
  /// Is there a configuration at all: does $OCIO name one?
  static bool configured();

  /// From the configuration that $OCIO names; pictures are taken to be in its role scene_linear. Empty names:
  /// its default display, and that display's default view.
  /// @throws Error{Errc::usage} for a display or view that the configuration does not have, with those that
  /// it has; Error{Errc::io} when it cannot be read.
  explicit DisplayView(const std::string& display = "", const std::string& view = "");
  ~DisplayView();
  DisplayView(const DisplayView&) = delete;
  DisplayView& operator=(const DisplayView&) = delete;

  /// "display / view"
  const std::string& name() const { return name_; }
  /// Straight RGBA code values, alpha as it is.
  std::vector<float> apply(const Picture& picture) const;

 private:
  struct Transform;
  std::string name_;
  std::unique_ptr<const Transform> transform_;
};

}  // namespace polestar
