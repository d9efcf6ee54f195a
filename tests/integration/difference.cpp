#include "integration/difference.h"

#include <algorithm>

namespace polestar::test {

Difference difference(int width, int height, const PixelColor& found, const PixelColor& expected) {
  Difference result;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::optional<Vec3> right = expected(x, y);
      const std::optional<Vec3> seen = right ? found(x, y) : std::nullopt;
      if (!seen) continue;
      const Vec3 error = *seen - *right;
      ++result.pixels;
      result.mean += error.lpNorm<1>() / 3;
      result.bias += error;
      // Not std::max, which forgets NaN.
      if (!(error.lpNorm<Eigen::Infinity>() <= result.worst)) result.worst = error.lpNorm<Eigen::Infinity>();
    }
  }
  result.mean /= static_cast<double>(result.pixels);
  result.bias /= static_cast<double>(result.pixels);
  return result;
}

}  // namespace polestar::test
