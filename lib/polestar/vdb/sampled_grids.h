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
#include "polestar/vdb/value_role.h"

namespace polestar {

/// One grid of floats or vec3s with its pyramid of halved resolutions, which is made when first needed.
/// Immutable, cheap to copy, safe from many threads.
class SampledGrid {
 public:
  bool isVector() const;
  const std::string& name() const;
  ValueRole role() const;
  bool isLevelSet() const;
  bool isFog() const;
  bool savedAsHalf() const;
  std::size_t activeVoxels() const;
  /// Of the voxels with a value: how many are NaN or infinite, and the world place of the first.
  struct NotFinite {
    std::size_t count = 0;
    Vec3 first = Vec3::Zero();
  };
  NotFinite notFinite() const;
  double voxelSize() const;  ///< world units; of the finest axis
  /// Edges of a voxel along x, y and z; nothing where voxels lie askew.
  std::optional<Vec3> voxelEdges() const;
  /// World box of the centers of the active voxels.
  Box activeBox() const;

  /// Averages over footprints around world points (edges as columns, world units). A voxel counts where it is
  /// active: `weight` is the share of the filter that met active voxels, 0 to 1, and the value the average
  /// over that share, so that what lies outside the body bleeds no background into its edge. Where the weight
  /// is 0 the value is 0. Scalars come as (s, s, s).
  ///
  /// A footprint below a voxel is read trilinearly; larger ones by up to 16 taps along their long axes, each
  /// from the levels of the pyramid that match its shortest one. About 0.2 us a tap.
  /// `footprints`: as many as points, or none: trilinear everywhere.
  void sample(std::span<const Vec3> world, std::span<const Mat3> footprints, std::span<Vec3f> values,
              std::span<float> weights) const;

 private:
  friend class SampledGrids;
  struct Data;
  template <class Tree>
  struct DataOf;
  explicit SampledGrid(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

/// Which surface of a file's grids is meant.
struct SurfaceChoice {
  std::optional<double> level;  ///< nothing: 0 of a level set, 1/2 of a fog
  double adaptivity = 0;        ///< 0: triangles of about a voxel everywhere; to 1: larger where it is flat
};

/// A grid that a file holds and that cannot be looked up here.
struct LeftOutGrid {
  std::string name, type;
};

/// A file's grids of floats and of vectors of floats.
class SampledGrids {
 public:
  /// @throws Error{Errc::io} for a file that is missing, truncated or no .vdb.
  explicit SampledGrids(const std::filesystem::path& path);

  const std::vector<SampledGrid>& grids() const { return grids_; }
  const std::vector<LeftOutGrid>& leftOut() const { return leftOut_; }
  /// The first grid of that name, scalar or vector as asked.
  const SampledGrid* find(const std::string& name, bool vector) const;
  /// Metadata of the grid `surface`, or of the first grid where there is none; empty without such a key.
  std::string metadata(const std::string& key) const;
  /// The grid of floats that says where the solid is: `surface`, else the first level set, else `density`,
  /// else the first fog; null where the file has none.
  const SampledGrid* solidGrid() const;
  /// The surface of that grid (OpenVDB's volumeToMesh), outward oriented, in world units; nothing where there
  /// is no such grid or no surface in it. @throws Error{Errc::io} for voxels that are NaN or infinite.
  std::optional<TriMesh> extractSurface(const SurfaceChoice& choice = {}) const;

 private:
  friend class GridSet;
  friend class SliceVolume;
  friend class SolidGrids;
  struct File;
  explicit SampledGrids(std::shared_ptr<const File> file);

  std::shared_ptr<const File> file_;
  std::vector<SampledGrid> grids_;
  std::vector<LeftOutGrid> leftOut_;
};

/// Grids from a block of voxels that comes slice by slice.
class SliceVolume {
 public:
  struct Pixel {
    Vec3f color = Vec3f::Zero();  ///< scene-linear, not multiplied by alpha
    float alpha = 1;
  };

  /// `voxelSize` along x, y, z; `corner` of the block, where all three are least. @throws Error{Errc::usage}
  /// for more voxels along an axis than fit.
  SliceVolume(int width, int height, const Vec3& voxelSize, const Vec3& corner, bool hasAlpha);
  ~SliceVolume();

  /// The next slice along +z: `width` pixels a row towards +x, rows from above, towards -y.
  void addSlice(std::span<const Pixel> pixels);

  /// `Cd` where alpha is above 0, and `density`, which is alpha, when there is one.
  SampledGrids finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace polestar
