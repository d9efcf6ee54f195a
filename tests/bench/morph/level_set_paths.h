#pragma once
// Ways between two solids on voxels, by OpenVDB alone: opponents that know surfaces and nothing of the points
// on them.

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::bench {

/// A level set of a frame, as the measures want it.
struct LevelSetFrame {
  double volume = 0;
  /// The zero level with OpenVDB's own mesher, quads cut in two.
  TriMesh surface;
};

/// Signed distances of two closed meshes on common voxels, exact within a band as wide as the solids.
class LevelSetPair {
 public:
  LevelSetPair(const TriMesh& first, const TriMesh& last, double voxel);
  ~LevelSetPair();

  /// OpenVDB's LevelSetMorphing (openvdb/tools/LevelSetMorph.h), narrow bands and schemes by its defaults:
  /// the surface moves along its normals at the difference of both distances. It has no time of its own in
  /// which it arrives. A first run finds it: the earliest at which the surface is a tenth of a voxel from the
  /// target's on average (root mean square), or comes no nearer. Frames are even shares of that time; only
  /// they are timed. `seen` gets every frame, between the timings.
  /// @return seconds of processor time of all frames but the first
  double morph(std::size_t frames, const std::function<void(const LevelSetFrame&)>& seen) const;

  /// (1 - t) times the distance from the first surface plus t times that from the last, made a distance
  /// again.
  /// @return seconds of processor time of all frames
  double blend(std::size_t frames, const std::function<void(const LevelSetFrame&)>& seen) const;

  /// Distances of points from the last surface, unsigned, trilinear between voxels.
  std::vector<double> distancesToLast(const std::vector<Vec3>& points) const;

 private:
  struct Grids;
  std::unique_ptr<Grids> grids_;
};

/// Root mean square; 0 of nothing.
double rootMeanSquare(const std::vector<double>& values);

}  // namespace polestar::bench
