#pragma once
// OpenEXR files of polestar's renderer and of Blender's, read back.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "polestar/io/picture.h"

namespace polestar::test {

/// What the two have in common, and what only ours has: empty in Blender's.
struct Exr {
  int width = 0, height = 0;
  std::vector<Vec3f> color;  ///< scene-linear, premultiplied; rows from above
  std::vector<float> alpha;
  std::vector<float> depth;       ///< our AOV `Z`
  std::vector<std::uint32_t> id;  ///< our AOV `id`
  std::optional<Picture::Camera> camera;

  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * width + x); }
};

/// Fails the test and gives an empty picture when the file cannot be read.
Exr readExr(const std::filesystem::path& path);

}  // namespace polestar::test
