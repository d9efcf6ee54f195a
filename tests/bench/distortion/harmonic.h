#pragma once
// The usual opponent: the volumetric harmonic map, linear on the tetrahedra of TetGen, with our conformal map
// as its boundary values.

#include <memory>
#include <optional>

#include "polestar/map/volume_map.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar::bench {

/// Inverted tetrahedra are part of it: where images overlap, inverse() takes one of them.
class HarmonicMap final : public VolumeMap {
 public:
  /// Nothing without `tetgen` on the PATH. @throws std::runtime_error when it fails.
  static std::optional<HarmonicMap> make(const StarShape& shape, const SphereMap& boundary);

  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override;
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override;
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override;

  std::size_t tetrahedra() const;
  std::size_t inverted() const;

 private:
  struct Data;
  explicit HarmonicMap(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

}  // namespace polestar::bench
