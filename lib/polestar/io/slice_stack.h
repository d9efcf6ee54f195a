#pragma once
// A solid texture as a numbered stack of pictures, as scanners, microscopes and painters leave them.

#include <filesystem>
#include <string>
#include <vector>

#include "polestar/core/context.h"
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

}  // namespace polestar
