#pragma once
// The grids of a .vdb, read to be looked up: at points, averaged over the parallelepiped that a voxel or
// pixel of somewhere else covers. A facade: OpenVDB stays in the .cpp.

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// One scalar or vector grid with its pyramid of halved resolutions. Immutable, cheap to copy, safe from many
/// threads.
class SampledGrid {
 public:
  enum class Kind { scalar, vector };
  Kind kind() const;
  const std::string& name() const;
  double voxelSize() const;  ///< world units; of the finest axis
  /// World box of the active voxels' centers.
  Box activeBox() const;

  /// Values at world points, averaged over footprints (edges as columns, world units; empty span: trilinear
  /// at points), in premultiplied terms: a voxel counts where it is active, by its share of the filter.
  /// `weight` is that share, 0 to 1; where it is 0 the value is 0. Scalars come as (s, s, s).
  void sample(std::span<const Vec3> world, std::span<const Mat3> footprints, std::span<Vec3f> values,
              std::span<float> weight) const;

 private:
  friend class SampledGrids;
  struct Data;
  std::shared_ptr<const Data> data_;
};

/// A file's grids of float and vec3s (doubles are read as floats, halves as what they are).
class SampledGrids {
 public:
  /// @throws Error{Errc::io} for a file that is missing, truncated or no .vdb.
  explicit SampledGrids(const std::filesystem::path& path, Context& context = Context::quiet());

  const std::vector<SampledGrid>& grids() const { return grids_; }
  /// The grid of that name, if there is one of this kind.
  std::optional<SampledGrid> find(const std::string& name, SampledGrid::Kind kind) const;
  /// Metadata of the grid `surface`, or of the first grid without it; empty when there is no such key.
  std::string metadata(const std::string& key) const;
  /// The surface of the level set `surface` (or of the fog `density` at 1/2), outward oriented, closed, in
  /// world units; nothing where the file has neither. Triangles of about a voxel, `adaptivity` 0 to 1 merges
  /// where it is flat.
  std::optional<TriMesh> extractSurface(double adaptivity = 0) const;

 private:
  struct File;
  std::shared_ptr<const File> file_;
  std::vector<SampledGrid> grids_;
};

}  // namespace polestar
