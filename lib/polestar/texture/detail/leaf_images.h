#pragma once
// Where the voxels of a leaf lie in a texture, and how much of it each covers. A map is smooth at the scale
// of a few voxels nearly everywhere: there 35 points answer for 512.

#include <atomic>
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
  /// `jacobians`: exact ones are wanted too, for vectors.
  LeafImager(const TextureRoute& route, bool jacobians) : route_(route), jacobians_(jacobians) {}

  /// A leaf that lies inside is interpolated by quadratic polynomials through 27 points, when these agree
  /// with the map at 8 more to a twentieth of what a voxel covers; else every voxel asks the map. Safe from
  /// many threads.
  void locate(const VoxelBatch& batch, LeafImages& images) const;

  std::size_t interpolatedLeaves() const { return interpolated_; }
  std::size_t leaves() const { return leaves_; }

 private:
  bool interpolate(const VoxelBatch& batch, LeafImages& images) const;
  void askEach(const VoxelBatch& batch, LeafImages& images) const;

  const TextureRoute& route_;
  bool jacobians_;
  mutable std::atomic<std::size_t> interpolated_{0}, leaves_{0};
};

}  // namespace polestar::detail
