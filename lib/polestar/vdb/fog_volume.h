#pragma once
// A fog of a .vdb, as rays march through it: where there is any, how dense it is and of which color. A
// facade: OpenVDB stays in the .cpp.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// A grid of density and, where the file has one, of colors. Immutable, cheap to copy, safe from many
/// threads; each thread reads it through a FogProbe of its own.
class FogVolume {
 public:
  /// The grid `density`, else the first fog volume; colors from `Cd` or `color`.
  /// @throws Error{Errc::io} for a file that is missing, truncated or no .vdb, that has no fog, an empty one,
  /// one of voxels that are no cubes, or one with densities that are negative or not finite.
  explicit FogVolume(const std::filesystem::path& path);

  const std::string& densityName() const;
  const std::string& colorName() const;  ///< empty: there are no colors
  double voxelSize() const;              ///< world units
  double largestDensity() const;
  std::size_t activeVoxels() const;
  /// Corners of the blocks that have fog, world units: their box is the fog's but for a block.
  std::vector<Vec3> outline() const;

 private:
  friend class FogProbe;
  struct Data;
  std::shared_ptr<const Data> data_;
};

/// A stretch of a ray that may meet fog, as distances from its origin.
struct FogSpan {
  double begin, end;
};

class FogProbe {
 public:
  explicit FogProbe(const FogVolume& fog);
  ~FogProbe();
  FogProbe(const FogProbe&) = delete;
  FogProbe& operator=(const FogProbe&) = delete;

  /// Stretches outside of which the density is 0, in order. `direction` of unit length; world units.
  void spans(const Vec3& origin, const Vec3& direction, std::vector<FogSpan>& result);
  /// Trilinear, at a world point.
  float density(const Vec3& world);
  /// Trilinear over those voxels around that have a color; white where none has.
  Vec3f color(const Vec3& world);

 private:
  struct Readers;
  std::unique_ptr<Readers> readers_;
};

}  // namespace polestar
