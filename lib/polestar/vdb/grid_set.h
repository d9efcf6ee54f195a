#pragma once
// All grids of a file, of ours or of others, to be chosen from, changed and written again. A facade: OpenVDB
// stays in the .cpp files.

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"
#include "polestar/vdb/sampled_grids.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {

/// How the voxels of a .vdb are packed; inactive ones are left out in any case.
enum class VdbCompression { blosc, zip, none };

/// Which axis points up in the data after it was turned: `y` turns a z-up scene to y-up, (x, y, z) ->
/// (x, z, -y), and `z` the other way, (x, y, z) -> (x, -z, y).
enum class UpAxis { y, z };

/// That turn of a point or vector of the world; no number is rounded.
Vec3 turnedUp(const Vec3& v, UpAxis up);

/// How a mesh becomes a level set.
struct VoxelizeOptions {
  double voxelSize = 0;  ///< mesh units, positive
  int halfWidth = 3;     ///< of the narrow band, voxels
  /// False: OpenVDB's meshToVolume. What overlaps becomes one solid; distances are exact within a voxel of
  /// the surface only and gaps thinner than two voxels may close; cavities are filled. True: the grids of
  /// SolidGrids.
  bool exact = false;

  void validate() const;  ///< @throws Error{Errc::usage}
};

class GridSet {
 public:
  /// All of a file's grids and its metadata; "-" is standard input.
  /// @throws Error{Errc::io} for a file that is missing, truncated, no .vdb or without a grid.
  explicit GridSet(const std::filesystem::path& path);
  /// Takes over grids that were made in memory; nobody else may look into them any more.
  explicit GridSet(SampledGrids&& grids);
  /// The grid `surface` of a closed mesh, placed as SolidGrids place it. Cost O(triangles + area /
  /// voxelSize^2); parallel.
  /// @throws as SolidGrids.
  GridSet(const TriMesh& closed, const VoxelizeOptions& options, Context& context = Context::quiet());
  ~GridSet();
  GridSet(GridSet&&) noexcept;
  GridSet& operator=(GridSet&&) noexcept;

  std::vector<GridInfo> describe() const;
  /// Shares the voxels with this object, which may not be changed meanwhile.
  SampledGrids lookUp() const;

  // --- changes; those that return lines say what could not be done, one line a grid ---

  /// Keeps those grids, in the file's order. @throws Error{Errc::usage} for a name that is not there, with
  /// those that are.
  void pick(std::span<const std::string> names);
  /// Leaves those out. @throws as pick; and when none would be left.
  void drop(std::span<const std::string> names);
  /// @throws Error{Errc::usage} for a name that is not there, in use, empty or with spaces.
  void rename(const std::string& from, const std::string& to);

  /// Of `surface` and `density` those that are asked for: one that is missing is made of the other (the
  /// file's level set, the file's fog), one that is not asked for is dropped. A fog of a level set is 1/2 on
  /// the surface and 1 a voxel inside; a level set of a fog has OpenVDB's distances (levelSetRebuild) to
  /// where the fog is `iso`.
  /// @throws Error{Errc::io} when the file has neither level set nor fog, or that surface is empty.
  void provide(bool surface, bool density, double iso, int halfWidth, Context& context = Context::quiet());

  /// Saves numbers as half floats, except where that would spoil them: coordinates (`rest`, `position`) and
  /// `green`, values beyond 65504, level sets of voxels below 6e-5.
  std::vector<std::string> halve();
  /// Makes one tile of blocks of voxels whose values differ by at most `tolerance`; level sets keep their
  /// band.
  void prune(double tolerance);

  /// New voxels of that size, on one lattice for all grids: the one of `surface`, else of the first grid, its
  /// lower corner kept. Level sets are built anew from their surface, fogs average over what a new voxel
  /// covers (background where nothing is), so do other grids of floats and vec3s over their active voxels;
  /// other types are read at the nearest voxel. Whole file at once; parallel.
  /// @throws Error{Errc::usage} when the new grids would not fit in memory; Error{Errc::cancelled}.
  std::vector<std::string> resample(double voxelSize, Context& context = Context::quiet());

  /// Turns the whole file about the origin: voxels are renumbered, none is sampled anew. Vectors follow their
  /// OpenVDB type; so does the metadata `polestar:center`. The map that the grids were made with does not
  /// turn along: `polestar:map_hash` goes.
  /// @throws Error{Errc::usage} for frustums and staggered vectors.
  std::vector<std::string> turn(UpAxis up);

  /// Written on every grid. A later value replaces an earlier one.
  void setMetadata(const std::string& key, const Metadata& value);

  /// As SolidGrids::write, with the file's own metadata. @throws Error{Errc::io}
  void write(const std::filesystem::path& path, VdbCompression compression = VdbCompression::blosc) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace polestar
