#pragma once
// The grids of any .vdb, carried along by a map of volumes: every voxel of the new grid asks where it comes
// from and reads the old grid there. A facade: OpenVDB stays in the .cpp, and the map is three functions.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {

/// A one-to-one map as grids need it; batched, called from many threads, output spans of the input's size.
struct GridWarp {
  /// Where points of the new grid's world come from in the old one's; NaN outside the map's image.
  std::function<void(std::span<const Vec3> after, std::span<Vec3> before)> source;
  /// The other way round; for grids of positions.
  std::function<void(std::span<const Vec3> before, std::span<Vec3> after)> target;
  /// d after / d before at points before; for vectors that the map turns and stretches.
  std::function<void(std::span<const Vec3> before, std::span<Mat3> derivative)> jacobian;
};

struct WarpGridsOptions {
  Box box;               ///< around the map's image, world units after the map
  double voxelSize = 0;  ///< of the new grids, positive
  /// Bytes that the new grids may take by a rough estimate; 0: 3/4 of the machine's memory.
  std::size_t memoryLimit = 0;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// What became of one grid.
struct WarpedGrid {
  std::string name, valueType;
  /// "interpolated", "nearest", "as vectors by the Jacobian", "as covectors by its inverse transpose" (and
  /// "... , normalized"), "as positions"; empty: left out.
  std::string how;
  std::string note;  ///< what to know about it; empty where there is nothing
  std::size_t activeVoxels = 0;
};

class WarpedGrids {
 public:
  /// Reads all grids of `path` and makes the new ones.
  ///
  /// A voxel holds a value where the map's image has its center and the old grid has an active voxel among
  /// the eight around the place it comes from (level sets: wherever the image is); elsewhere it is inactive
  /// and the old grid's background. Scalars and vectors are read trilinearly; whole numbers and booleans from
  /// the nearest voxel. Vectors follow their OpenVDB type: invariant ones as they are, contravariant relative
  /// by the Jacobian, covariant by its inverse transpose (normalized where the type says so), contravariant
  /// absolute as positions. A level set is no distance any more behind a map that is not rigid: its values
  /// are carried, its class becomes unknown, and the note says so. Class, names, metadata (except polestar:
  /// and file_ entries) and half floats stay; frustums are read and come out on the one uniform transform of
  /// all new grids, whose voxel (0, 0, 0) has its lower corner in the box's. Grids of other types are left
  /// out. Cost: one batch of `source` a leaf whatever the number of grids; parallel, the same grids for any
  /// number of threads.
  /// @throws Error{Errc::io} for a file that cannot be read or has no grid to carry; Error{Errc::usage} when
  /// the grids would not fit in memory; Error{Errc::cancelled}; what the map throws.
  WarpedGrids(const std::filesystem::path& path, const GridWarp& warp, const WarpGridsOptions& options,
              Context& context = Context::quiet());
  ~WarpedGrids();
  WarpedGrids(WarpedGrids&&) noexcept;
  WarpedGrids& operator=(WarpedGrids&&) noexcept;

  /// In the order of the file, those left out too.
  const std::vector<WarpedGrid>& report() const;
  /// Voxels whose center has a place that it comes from.
  std::size_t voxelsInside() const;

  /// Written on every grid. A later value replaces an earlier one.
  void setMetadata(const std::string& key, const Metadata& value);

  /// As SolidGrids::write. @throws Error{Errc::io}
  void write(const std::filesystem::path& path) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace polestar
