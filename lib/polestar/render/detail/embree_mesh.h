#pragma once
// Triangles that rays are traced against, in packets of 16.

#include <embree3/rtcore.h>

#include <cstdint>
#include <span>

#include "polestar/mesh/tri_mesh.h"
#include "polestar/render/detail/ray_bundle.h"

namespace polestar::detail {

/// One stretch of a ray.
struct RayStretch {
  std::uint32_t ray;
  float near, far;
  std::int16_t plane;  ///< where the stretch begins; -1: in the open
};

class EmbreeMesh {
 public:
  /// @throws Error{Errc::io} when Embree cannot start or build.
  explicit EmbreeMesh(const TriMesh& mesh);
  ~EmbreeMesh();
  EmbreeMesh(const EmbreeMesh&) = delete;
  EmbreeMesh& operator=(const EmbreeMesh&) = delete;

  RTCScene scene() const { return scene_; }

  static constexpr std::size_t kPacket = 16;
  /// The first crossings of up to kPacket stretches, moved by -shift; rays go about the same way.
  RTCRayHit16 firstHits(const RayBundle& rays, std::span<const RayStretch> stretches,
                        const Vec3f& shift) const;
  /// Sets blocked[ray] where a stretch crosses anything. `coherent`: rays go about the same way.
  void block(const RayBundle& rays, std::span<const RayStretch> stretches, const Vec3f& shift, bool coherent,
             std::span<std::uint8_t> blocked) const;

 private:
  void release();

  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

}  // namespace polestar::detail
