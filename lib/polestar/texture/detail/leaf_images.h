#pragma once
// Where the voxels of a leaf lie in a texture, and how much of it each covers. What is dear is asked for
// sparingly: a map is smooth at the scale of a few voxels nearly everywhere, and there a quarter of the
// points answer for all.

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "polestar/texture/texture_route.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar::detail {

struct LeafImages {
  std::vector<Vec3> places;      ///< NaN where the route has no answer
  std::vector<Mat3> footprints;  ///< of one voxel: the images of its edges
  std::vector<Mat3> jacobians;   ///< when asked for
};

class LeafImager {
 public:
  /// `jacobians`: these are wanted too, for vectors. `mapped` (null: none) has the target's ball coordinates
  /// as its grid `rest`, in the voxels of the batches to come: they are read, and the target's map is not
  /// asked.
  LeafImager(const TextureRoute& route, bool jacobians, const SolidGrids* mapped)
      : route_(route), jacobians_(jacobians), mapped_(mapped) {}

  /// Where `rest` is read and the way ends in the ball, every voxel has its own and differences to its
  /// neighbours say what it covers. Else a map is asked: a leaf is eight blocks of 4^3 voxels. Blocks inside
  /// the solid are interpolated by quadratic polynomials through 27 points two voxels apart, most of them
  /// shared, when these agree with the map at four more, in between, to a tenth of what a voxel covers; in
  /// the others every voxel asks. Safe from many threads.
  void locate(const VoxelBatch& batch, LeafImages& images) const;

  /// Those that maps were asked for.
  std::size_t blocks() const { return blocks_; }
  std::size_t interpolatedBlocks() const { return interpolated_; }

 private:
  const TextureRoute& route_;
  bool jacobians_;
  const SolidGrids* mapped_;
  mutable std::atomic<std::size_t> blocks_{0}, interpolated_{0};
};

}  // namespace polestar::detail
