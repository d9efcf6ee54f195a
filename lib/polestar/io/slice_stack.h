#pragma once
// A solid texture as a numbered stack of pictures, as scanners, microscopes and painters leave them.

#include <filesystem>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/io/frame_path.h"
#include "polestar/vdb/sampled_grids.h"

namespace polestar {

struct SliceOptions {
  Vec3 voxelSize = Vec3::Ones();  ///< of a pixel across and down, and from slice to slice; positive
  Vec3 origin = Vec3::Zero();     ///< the corner of the block where x, y and z are least

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// The files of a name with a place for a number (frame_path.h) that are there, by number.
/// @throws Error{Errc::io} when there are fewer than two or numbers are missing between (the message says
/// which); Error{Errc::usage} for a name without such a place.
std::vector<std::filesystem::path> numberedFiles(const std::filesystem::path& pattern);

/// Reads a stack: pictures' columns go along +x, rows from above along -y, numbers along +z. Color `Cd`
/// (scene-linear: files of whole numbers are taken for sRGB unless they say they are linear), gray ones alike
/// in all three. With an alpha channel, color is there where alpha is above 0, and `density` holds alpha;
/// without one it is everywhere. Any format of OpenImageIO. Memory: 12 bytes a voxel that is there, one slice
/// besides.
/// @throws Error{Errc::io} for what cannot be read and for slices of unequal size or channels (the first that
/// differs is named); what numberedFiles throws; Error{Errc::cancelled}.
SampledGrids readSlices(const std::filesystem::path& pattern, const SliceOptions& options = {},
                        Context& context = Context::quiet());

/// Whether writeSlices can write to that name: .png, .tif, .tiff or .exr.
bool isSliceOutputName(const std::filesystem::path& path);

/// What a stack of slices shows, and where it lies: what readSlices wants back.
struct SliceLayout {
  std::string grid;    ///< `Cd` or `color`, or a grid of scalars
  bool color = false;  ///< else gray
  bool alpha = false;  ///< `density`, where it goes along with colors; else where the grid has values
  int width = 0, height = 0, count = 0;
  SliceOptions place;
};

/// The slices of a file's colors; of `density`, or its only grid of scalars, where it has none.
/// @throws Error{Errc::usage} when there is no such grid, or several, and for voxels that lie askew.
SliceLayout planSlices(const SampledGrids& grids);

/// Writes them to pattern.at(1) ... pattern.at(count), laid out as readSlices reads them: .png of 16 bits a
/// channel, colors sRGB and scalars linear, .tif and .exr of floats, linear. Each file is written atomically.
/// Returns how many values .png had to clip to 0 or 1.
/// @throws Error{Errc::io}; Error{Errc::cancelled}.
std::size_t writeSlices(const FramePath& pattern, const SampledGrids& grids, const SliceLayout& stack,
                        Context& context = Context::quiet());

}  // namespace polestar
