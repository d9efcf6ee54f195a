#pragma once
// Any map that is given at the vertices of tetrahedra, linear in between: the form in which all methods are
// compared.

#include <memory>
#include <span>
#include <vector>

#include "polestar/core/frame.h"
#include "polestar/map/volume_map.h"
#include "tet_mesh.h"

namespace polestar::bench {

/// Inverted tetrahedra are part of it: where images overlap, inverse() takes one of them. Points of the ball
/// above the images' surface, a polyhedron with its corners on the sphere, go down to it.
class TetMap final : public VolumeMap {
 public:
  /// `mesh` in the inner frame; `image` one a vertex, in the unit ball.
  TetMap(const Frame& frame, TetMesh mesh, std::vector<Vec3> image);

  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override;
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override;
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

}  // namespace polestar::bench
