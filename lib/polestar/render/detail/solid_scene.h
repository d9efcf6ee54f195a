#pragma once
// The solid that the picture shows: a closed surface, cut by planes into pieces that may stand apart. Rays
// are Embree's; what planes add is arithmetic on their intervals, so cuts are exact planes and no mesh is
// cut.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "polestar/mesh/tri_mesh.h"
#include "polestar/render/detail/plane.h"
#include "polestar/render/detail/ray_bundle.h"

namespace polestar::detail {

/// A part of the solid, cut out of it or what a cut leaves.
struct Piece {
  /// The convex region on the inner side of all planes.
  std::vector<Plane> planes;
  /// The piece is what of the solid lies outside that region (a notch); else what lies inside.
  bool notched = false;
  Vec3 shift = Vec3::Zero();  ///< from where it belongs to where it is shown

  bool holds(const Vec3& point) const {
    const bool inside =
        std::all_of(planes.begin(), planes.end(), [&](const Plane& p) { return p.height(point) <= 0; });
    return inside != notched;
  }
};

/// Where a ray first meets the solid; compact, as a tile keeps thousands.
struct SceneHit {
  float distance = std::numeric_limits<float>::infinity();
  float u = 0, v = 0;          ///< on the skin: weights of the triangle's corners 1 and 2
  std::uint32_t triangle = 0;  ///< on the skin
  std::int16_t piece = 0;
  std::int16_t plane = -1;  ///< of a cut face: which of the piece's; -1 on the skin

  bool none() const { return distance == std::numeric_limits<float>::infinity(); }
  bool skin() const { return plane < 0; }
};

/// What light needs to know of a hit, as shown.
struct ShadingPoint {
  Vec3f normal;         ///< geometric, outward
  Vec3f shadingNormal;  ///< interpolated within creases
  Vec3f shadowOrigin;   ///< where shadow rays start: clear of the facets that a curved surface stands for
};

/// Immutable after construction; every query may be called from many threads. Coordinates of about unit size.
class SolidScene {
 public:
  /// A closed, outward-oriented surface and its pieces, at least one.
  /// @throws Error{Errc::io} when Embree cannot start.
  SolidScene(TriMesh surface, std::vector<Piece> pieces, double creaseAngle);
  ~SolidScene();
  SolidScene(SolidScene&&) noexcept;

  /// First points of the solid along rays that start outside of it. Rays whose numbers are close should be
  /// close: they are traced in packets of 16.
  void firstHits(const RayBundle& rays, std::span<SceneHit> hits) const;

  /// Does the solid lie between a ray's origin (on its surface or outside) and infinity? `coherent`: as for
  /// firstHits; else rays go where they like.
  void occluded(const RayBundle& rays, bool coherent, std::span<std::uint8_t> blocked) const;

  ShadingPoint shadingPoint(const SceneHit& hit, const Vec3f& origin, const Vec3f& direction) const;
  /// The point of the solid, in double precision and before its piece is shifted, so that it lies on the very
  /// surface or plane.
  Vec3 solidPoint(const SceneHit& hit, const Vec3& origin, const Vec3& direction) const;

  const TriMesh& surface() const { return surface_; }
  const std::vector<Piece>& pieces() const { return pieces_; }
  const Vec3& faceNormal(std::size_t triangle) const { return faceNormals_[triangle]; }
  /// Corners of the convex hull's kind: vertices of the pieces and points where edges cross planes, as shown.
  std::vector<Vec3> outline() const;

 private:
  struct Embree;
  struct Query;
  void hitNotched(std::size_t piece, const RayBundle& rays, std::span<SceneHit> hits) const;
  void hitKept(std::size_t piece, const RayBundle& rays, std::span<SceneHit> hits) const;
  void blockNotched(std::size_t piece, const RayBundle& rays, bool coherent,
                    std::span<std::uint8_t> blocked) const;
  void blockKept(std::size_t piece, const RayBundle& rays, std::span<std::uint8_t> blocked) const;
  bool insideBehind(const Vec3f& shift, const RayBundle& rays, const Query& query) const;
  void trace(std::size_t piece, const RayBundle& rays, std::span<const Query> queries,
             std::span<SceneHit> hits) const;

  TriMesh surface_;
  std::vector<Piece> pieces_;
  std::vector<Vec3> faceNormals_;
  std::vector<std::array<Vec3f, 3>> cornerNormals_;
  std::vector<Vec3f> vertices_;
  std::unique_ptr<Embree> embree_;
};

}  // namespace polestar::detail
