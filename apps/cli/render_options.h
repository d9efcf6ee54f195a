#pragma once
// The forms that values of `render`'s options take.

#include <string>

#include "polestar/render/render_solid.h"

namespace polestar::cli {

/// "x", "-y", "z,0.2", "1,1,0" or "1,1,0,0.2": normal and offset. @throws Error{Errc::usage} (all four)
CutPlane parseCut(const std::string& text);

/// "1280x960"
void parseSize(const std::string& text, RenderOptions& options);

/// "x0,y0,x1,y1"
PixelBox parseCrop(const std::string& text);

/// "#rrggbb", "white", "black", "grey", or "transparent"
void parseBackground(const std::string& text, RenderOptions& options);

}  // namespace polestar::cli
