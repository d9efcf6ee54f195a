#pragma once
// The interface on which everything downstream rests: transfer, morph, reaction, hexahedra, grids and
// pictures see nothing of a parameterized solid but this.

#include <span>

#include "polestar/core/types.h"

namespace polestar {

/// A one-to-one map of a solid (mesh units) onto a domain such as the unit ball. Batched; every function may
/// be called from many threads at once and runs in parallel inside for large batches. Output spans have the
/// input's size.
class VolumeMap {
 public:
  virtual ~VolumeMap() = default;

  /// Solid (mesh units) -> domain. Points outside the solid give NaN.
  virtual void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const = 0;

  /// Domain -> solid (mesh units). Points outside the domain give NaN.
  virtual void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const = 0;

  /// d domain / d solid (domain units over mesh units) at points of the solid; NaN outside.
  virtual void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const = 0;
};

}  // namespace polestar
