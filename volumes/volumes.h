#pragma once
// The table of shapes in this folder, shared by the program that writes them and the test that holds the
// files to it.

#include <functional>
#include <string>
#include <vector>

#include "polestar/mesh/tri_mesh.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {

struct Volume {
  std::string file;            ///< name in volumes/
  std::string comment;         ///< what it is, one line in the file's header
  Vec3 center = Vec3::Zero();  ///< a point about which it is star-shaped, not always the best one
  std::function<TriMesh()> make;
};

std::vector<Volume> shippedVolumes();

/// What kSampleTexture holds: the texture kiwi in fruit.ply, 48 voxels high, colors and fibers as half
/// floats. Takes seconds.
inline constexpr const char* kSampleTexture = "kiwi.vdb";
SolidGrids sampleTexture();

}  // namespace polestar
