#pragma once
// The sparse grids of one solid, as they go into a .vdb: level set, fog, and attributes on the voxels inside plus a
// padding around them. A facade: OpenVDB stays in the .cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar {

struct GridOptions {
  double voxelSize = 0;   ///< mesh units, positive
  int padding = 3;        ///< voxels around the surface that carry attributes too; unpadded grids render with black moire
  int halfWidth = 3;      ///< of the level set's narrow band, voxels

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Voxel size that puts `dim` voxels along the longest side of the mesh's box.
double voxelSizeFor(const TriMesh& mesh, int dim);

/// Voxel centers of one leaf, handed to a sampler. Called from many threads.
struct VoxelBatch {
  std::span<const Vec3> points;            ///< mesh units
  std::span<const float> signedDistance;   ///< mesh units, negative inside, clamped to the half-width
};

/// How a vector grid transforms, in OpenVDB's terms.
enum class VectorRole { invariant, contravariantRelative };

using Metadata = std::variant<std::string, double, std::int64_t, Vec3>;

class SolidGrids {
 public:
  /// Voxelizes a closed, outward-oriented surface: `surface` (level set) and `density` (fog with a ramp one band wide).
  /// One uniform linear transform for all grids of the object: voxel (0, 0, 0) lies near the box's lower corner.
  /// @throws Error{Errc::usage} when the grid would not fit in memory or be smaller than 4 voxels along its longest side.
  SolidGrids(const TriMesh& surface, const GridOptions& options, Context& context = Context::quiet());
  ~SolidGrids();
  SolidGrids(SolidGrids&&) noexcept;
  SolidGrids& operator=(SolidGrids&&) noexcept;

  double voxelSize() const;
  std::size_t insideVoxels() const;  ///< voxels with surface < 0
  std::size_t activeVoxels() const;  ///< the former and the padding

  /// Adds a grid on the inside and padding voxels (`padded`) or the inside alone. The sampler fills one value a point;
  /// it runs in parallel over leaves. @throws what the sampler throws; @throws Error{Errc::usage} for a name in use.
  void addVector(const std::string& name, VectorRole role,
                 const std::function<void(const VoxelBatch&, std::span<Vec3f>)>& sample, bool padded = true,
                 Context& context = Context::quiet());
  void addScalar(const std::string& name, const std::function<void(const VoxelBatch&, std::span<float>)>& sample,
                 bool padded = false, Context& context = Context::quiet());

  /// Written on every grid (file-level metadata gets lost in other tools), under the key as given.
  void setMetadata(const std::string& key, const Metadata& value);

  /// A leaf of a vector grid and one layer of its neighbours towards +x, +y, +z: size^3 samples, z fastest.
  struct Brick {
    static constexpr int kSize = 9;
    std::array<int, 3> origin;                ///< index coordinates of the first sample
    std::span<const Vec3f> values;
    std::span<const float> signedDistance;    ///< mesh units
    std::span<const std::uint8_t> active;     ///< 1 where the vector grid holds a value
  };
  /// Visits every leaf that has an active voxel, in parallel; `visit` must be safe for that. The values are those that
  /// write() writes. `leafIndex` runs from 0 to leafCount() - 1, for deterministic reductions.
  void visitBricks(const std::string& vectorGrid,
                   const std::function<void(std::size_t leafIndex, const Brick&)>& visit) const;
  std::size_t leafCount(const std::string& grid) const;

  /// World position (mesh units) of an index-space point.
  Vec3 indexToWorld(const Vec3& index) const;

  /// Writes all grids: to a temporary name in the same folder, synced, then renamed. "-" writes to standard output.
  /// @throws Error{Errc::io}; then no file is left under either name.
  void write(const std::filesystem::path& path) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What `polestar info` says of a .vdb.
struct GridInfo {
  std::string name, valueType, gridClass;
  std::size_t activeVoxels = 0, memoryBytes = 0;
  std::array<int, 3> indexMin{}, indexMax{};
  double voxelSize = 0;
  std::vector<std::pair<std::string, std::string>> metadata;
};

/// @throws Error{Errc::io} for a file that is missing, truncated or no .vdb.
std::vector<GridInfo> readGridInfo(const std::filesystem::path& path);

}  // namespace polestar
