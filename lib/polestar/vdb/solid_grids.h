#pragma once
// The sparse grids of one solid, as they go into a .vdb: level set, fog, and attributes on the voxels inside
// plus a padding around them. A facade: OpenVDB stays in the .cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"
#include "polestar/vdb/sampled_grids.h"
#include "polestar/vdb/value_role.h"

namespace polestar {

struct GridOptions {
  double voxelSize = 0;  ///< mesh units, positive
  /// Voxels around the solid that carry attributes too: all centers nearer to it than this many voxels. Three
  /// cover what trilinear and quadratic filters read at any point of the solid; unpadded grids render with
  /// black moire.
  int padding = 3;
  int halfWidth = 3;  ///< of the level set's narrow band, voxels; raised to `padding` where that is larger
  /// Bytes that all grids may take by a rough estimate; 0: 3/4 of the machine's memory.
  std::size_t memoryLimit = 0;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Voxel size that puts `dim` voxels along the longest side of the mesh's box.
/// @throws Error{Errc::usage} for dim < 4 or a mesh without extent.
double voxelSizeFor(const TriMesh& mesh, int dim);

/// Voxel centers of one leaf, handed to a sampler. Called from many threads.
struct VoxelBatch {
  static constexpr int kLeafSize = 8;     ///< voxels along a leaf
  Vec3 corner;                            ///< center of the leaf's first voxel, mesh units
  std::array<int, 3> first{};             ///< that voxel, index coordinates
  double voxelSize = 0;                   ///< mesh units
  std::span<const std::uint16_t> places;  ///< of the points in the leaf: 64 x + 8 y + z, ascending
  std::span<const Vec3> points;           ///< mesh units
  std::span<const float> signedDistance;  ///< mesh units, negative inside, clamped to the half-width
};

/// A grid to be filled.
struct Attribute {
  std::string name;
  bool vector = false;
  ValueRole role = ValueRole::invariant;
  bool half = false;  ///< saved as half floats: colors, never coordinates
};

/// Where a sampler puts what it knows of one leaf: for each attribute one value a point, 0 at first.
class AttributeValues {
 public:
  virtual std::span<float> scalars(std::size_t attribute) = 0;
  virtual std::span<Vec3f> vectors(std::size_t attribute) = 0;
  /// Whether the voxel holds a value; 1 at first. Voxels without one are inactive and hold 0.
  virtual std::span<std::uint8_t> active(std::size_t attribute) = 0;

 protected:
  ~AttributeValues() = default;
};

using Metadata = std::variant<std::string, double, std::int64_t, Vec3>;

class SolidGrids {
 public:
  /// Voxelizes a closed, outward-oriented, embedded surface.
  ///
  /// `surface`: exact distance to the triangles in the band, mesh units, negative inside; the side of every
  /// voxel by parity of crossings, right for gaps and blades thinner than a voxel. `density`: fog, 1 from one
  /// voxel inside the surface, 0 from one voxel outside, linear in the distance between: 1/2 on the surface,
  /// so that the edge is antialiased, the fog's mass is the solid's up to (voxel / curvature radius)^2, and
  /// all that a renderer sees of it lies within the padding. One uniform linear transform for all grids of
  /// the object; the box's lower corner is the lower corner of voxel (0, 0, 0), a mesh that is `dim` voxels
  /// long fills voxels 0 .. dim - 1. Geometry is computed in voxel units from doubles: offsets of 1e6 and
  /// sizes of 1e-7 cost no accuracy. (Programs that turn a grid's transform into a 4x4 matrix with OpenVDB,
  /// Blender among them, abort on voxels below 1.45e-5 units; a warning is logged.) Cost O(triangles + area /
  /// voxelSize^2), about 2 us a voxel of the band; parallel, same grids for any thread count.
  /// @throws Error{Errc::usage} when the grids would not fit in memory (the message says which size does) or
  /// the solid is smaller than 4 voxels along its longest side.
  SolidGrids(const TriMesh& surface, const GridOptions& options, Context& context = Context::quiet());
  ~SolidGrids();
  SolidGrids(SolidGrids&&) noexcept;
  SolidGrids& operator=(SolidGrids&&) noexcept;

  /// The solid of a .vdb that `polestar map` wrote: `surface`, `density` and `rest` as they are there,
  /// without their metadata. Nothing where one of them is missing, was saved as half floats or lies in voxels
  /// of its own, or where `rest` covers something else than the solid and a padding of GridOptions::padding.
  /// @throws Error{Errc::io} for a file that is missing, truncated or no .vdb.
  static std::optional<SolidGrids> read(const std::filesystem::path& path);
  /// The same solid: `surface`, `density` and of the other grids those named, without metadata. Voxels are
  /// shared, not copied.
  /// @throws Error{Errc::usage} for a name that is not there.
  SolidGrids sharing(const std::vector<std::string>& attributes) const;

  double voxelSize() const;
  std::size_t insideVoxels() const;  ///< voxels with surface < 0
  std::size_t activeVoxels() const;  ///< the former and the padding

  /// Adds grids on the inside and padding voxels (`padded`) or the inside alone, background 0. The sampler
  /// fills all of a leaf's values at once; it runs in parallel over leaves, once for each voxel.
  /// @throws Error{Errc::usage} for a name that is in use, empty or has spaces; Error{Errc::cancelled}; what
  /// the sampler throws. No grid is added then.
  void add(std::span<const Attribute> attributes,
           const std::function<void(const VoxelBatch&, AttributeValues&)>& sample, bool padded = true,
           Context& context = Context::quiet());
  /// One grid of vectors, or one of scalars.
  void addVector(const std::string& name, ValueRole role,
                 const std::function<void(const VoxelBatch&, std::span<Vec3f>)>& sample, bool padded = true,
                 Context& context = Context::quiet());
  void addScalar(const std::string& name,
                 const std::function<void(const VoxelBatch&, std::span<float>)>& sample, bool padded = false,
                 Context& context = Context::quiet());

  /// Written on every grid (file-level metadata gets lost in other tools), under the key as given. A later
  /// value replaces an earlier one.
  void setMetadata(const std::string& key, const Metadata& value);

  /// A leaf of a vector grid and one layer of its neighbours towards +x, +y, +z: size^3 samples, z fastest.
  struct Brick {
    static constexpr int kSize = 9;
    std::array<int, 3> origin;  ///< index coordinates of the first sample
    std::span<const Vec3f> values;
    std::span<const float> signedDistance;  ///< mesh units
    std::span<const std::uint8_t> active;   ///< 1 where the vector grid holds a value
  };
  /// Visits every leaf that has an active voxel, in parallel; `visit` must be safe for that. The values are
  /// those that write() writes. `leafIndex` runs from 0 to leafCount() - 1, for deterministic reductions.
  void visitBricks(const std::string& vectorGrid,
                   const std::function<void(std::size_t leafIndex, const Brick&)>& visit) const;
  /// @throws Error{Errc::usage} when there is no such vector grid (both).
  std::size_t leafCount(const std::string& vectorGrid) const;

  /// A cube of samples of a vector grid, size^3, z fastest, from `lowest` on; 0 and inactive where the grid
  /// holds no value.
  struct Cube {
    std::array<int, 3> lowest{};  ///< index coordinates
    int size = 0;
    std::vector<Vec3f> values;
    std::vector<float> signedDistance;  ///< mesh units
    std::vector<std::uint8_t> active;
  };
  /// @throws Error{Errc::usage} when there is no such vector grid (both).
  Cube readCube(const std::string& vectorGrid, const std::array<int, 3>& lowest, int size) const;
  /// Puts the values of a cube's active samples, listed by their place in it, in the place of those that the
  /// grid holds.
  void replace(const std::string& vectorGrid, const Cube& cube, std::span<const std::size_t> samples);

  /// The grids as they are now, to be looked up; shares their voxels, so nothing may replace these meanwhile.
  SampledGrids lookUp() const;

  /// World position (mesh units) of an index-space point.
  Vec3 indexToWorld(const Vec3& index) const;

  /// Writes all grids, the same bytes every time: to a temporary name in the same folder, synced, then
  /// renamed. "-" writes to standard output (built in memory first, since the format wants a seekable
  /// stream).
  /// @throws Error{Errc::io}; an earlier file of that name is then as it was, and no temporary is left.
  void write(const std::filesystem::path& path) const;

 private:
  struct Impl;
  explicit SolidGrids(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// What `polestar info` says of a .vdb.
struct GridInfo {
  std::string name, valueType, gridClass;
  std::size_t activeVoxels = 0, memoryBytes = 0;
  std::array<int, 3> indexMin{}, indexMax{};
  double voxelSize = 0;
  ValueRole role = ValueRole::invariant;  ///< of vectors
  Box box;  ///< around the active voxels, world units; empty where there is none
  std::vector<std::pair<std::string, std::string>> metadata;
};

/// What a grid says of itself, without its voxels.
struct GridHeader {
  std::string name;
  std::vector<std::pair<std::string, std::string>> metadata;  ///< values as text
};

/// Sorted by name. Reads no trees, but checks that the file is as long as they need: half a millisecond.
/// @throws Error{Errc::io} for a file that is missing, truncated, no .vdb, or without a grid.
std::vector<GridHeader> readGridHeaders(const std::filesystem::path& path);

/// Reads the whole file, so that what is returned is a file that can be read.
/// @throws Error{Errc::io} for a file that is missing, truncated or no .vdb.
std::vector<GridInfo> readGridInfo(const std::filesystem::path& path);

}  // namespace polestar
