#pragma once
// How far the colors of a picture are from what they should be.

#include <functional>
#include <optional>

#include "integration/exr.h"

namespace polestar::test {

struct Difference {
  std::size_t pixels = 0;      ///< that were compared
  double mean = 0, worst = 0;  ///< of absolute differences, over pixels and channels
  Vec3 bias = Vec3::Zero();    ///< the mean of signed ones
};

/// A pixel's color; nothing where there is none to compare.
using PixelColor = std::function<std::optional<Vec3>(int x, int y)>;

/// Over all pixels of a width and height for which both have a color.
Difference difference(int width, int height, const PixelColor& found, const PixelColor& expected);

}  // namespace polestar::test
