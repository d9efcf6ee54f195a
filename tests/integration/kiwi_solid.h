#pragma once
// A solid that the tool filled with kiwi, our picture of a cut through it, and how far another's may be from
// that.

#include "cli/run_tool.h"
#include "integration/blender.h"
#include "integration/difference.h"

namespace polestar::test {

// Of scene-linear colors in [0, 1], absolute, over the pixels of a cut and their channels. Found are 0.0004
// to 0.0008: Blender shows a slab of a fifth of a voxel, ours is a plane, and Cycles reads colors as half
// floats. One step of 8 bits of sRGB is 0.004 in the middle greys, so to the eye both are the same.
inline constexpr double kSame = 0.002;
// Of a single channel: at the edges of seeds.
inline constexpr double kSameWorst = 0.03;
// What is wrong has to differ by much more; found are 0.011 and above.
inline constexpr double kOther = 3 * kSame;

/// A mesh, mapped and filled with kiwi in several ways; names in the folder.
class KiwiSolid {
 public:
  explicit KiwiSolid(const std::filesystem::path& mesh);

  /// Returns the path of a .vdb that `polestar transfer` wrote, with these options.
  std::string fill(const std::string& name, const std::vector<std::string>& options = {});
  /// Our picture of a cut, seen at right angles.
  Exr cut(const std::string& vdb, const Vec3& normal) const;
  BlenderJob job(const std::string& vdb, const std::map<std::string, std::string>& grids) const;

 private:
  testing::ScratchFolder folder_;
  double voxelSize_ = 0;
};

/// Does a pixel show the cut, and all others up to `rim` away in x and y, too?
bool isDeep(const Exr& ours, int x, int y, int rim);

PixelColor colors(Exr picture);
/// What a fog scatters, whatever its density.
PixelColor straightColors(Exr picture);

/// On the cut of our picture, without its rim.
Difference differenceOf(const PixelColor& found, const Exr& ours);
void expectSame(const PixelColor& found, const Exr& ours);

}  // namespace polestar::test
