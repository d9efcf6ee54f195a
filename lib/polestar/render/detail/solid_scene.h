#pragma once
// The solid that the picture shows: a closed surface, cut by planes into pieces that may stand apart. Rays
// are Embree's; what planes add is arithmetic on their intervals, so cuts are exact planes and no mesh is
// cut. Beside it may stand objects of one color each, which are triangles and nothing else.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "polestar/mesh/tri_mesh.h"
#include "polestar/render/detail/plane.h"
#include "polestar/render/detail/ray_bundle.h"
#include "polestar/render/detail/smooth_mesh.h"

namespace polestar::detail {

struct RayStretch;

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
  std::int16_t plane = -1;   ///< of a cut face: which of the piece's; -1 on the skin
  std::int16_t object = -1;  ///< -1 on the solid

  bool none() const { return distance == std::numeric_limits<float>::infinity(); }
  bool skin() const { return plane < 0 && object < 0; }
};

/// What stands on the stage.
struct SceneParts {
  TriMesh surface;            ///< of the solid: closed, outward-oriented
  std::vector<Piece> pieces;  ///< at least one
  bool hollow = false;        ///< the solid is its skin alone, seen from both sides
  std::vector<TriMesh> objects = {};
};

/// Immutable after construction; every query may be called from many threads. Coordinates of about unit size.
class SolidScene {
 public:
  /// @throws Error{Errc::io} when Embree cannot start.
  SolidScene(SceneParts parts, double creaseAngle);
  ~SolidScene();
  SolidScene(SolidScene&&) noexcept;

  /// First points of the solid and the objects along rays that start outside of it. Rays whose numbers are
  /// close should be close: they are traced in packets of 16.
  void firstHits(const RayBundle& rays, std::span<SceneHit> hits) const;

  /// Does anything lie between a ray's origin (on its surface or outside) and infinity? `coherent`: as for
  /// firstHits; else rays go where they like.
  void occluded(const RayBundle& rays, bool coherent, std::span<std::uint8_t> blocked) const;

  ShadingPoint shadingPoint(const SceneHit& hit, const Vec3f& origin, const Vec3f& direction) const;
  /// The point of the solid or object, in double precision and before its piece is shifted, so that it lies
  /// on the very surface or plane.
  Vec3 solidPoint(const SceneHit& hit, const Vec3& origin, const Vec3& direction) const;

  /// From where the hit's part of the solid belongs to where it is shown; 0 for objects.
  Vec3 shiftOf(const SceneHit& hit) const { return hit.object < 0 ? pieces_[hit.piece].shift : Vec3::Zero(); }

  const TriMesh& surface() const { return skin_.mesh(); }
  const std::vector<Piece>& pieces() const { return pieces_; }
  const Vec3& faceNormal(std::size_t triangle) const { return skin_.faceNormal(triangle); }
  /// Corners of the convex hull's kind: vertices of the pieces and points where edges cross planes, as shown.
  std::vector<Vec3> outline() const;

 private:
  struct Embree;
  void hitNotched(std::size_t piece, const RayBundle& rays, std::span<SceneHit> hits) const;
  void hitKept(std::size_t piece, const RayBundle& rays, std::span<SceneHit> hits) const;
  void hitObjects(const RayBundle& rays, std::span<SceneHit> hits) const;
  void blockNotched(std::size_t piece, const RayBundle& rays, bool coherent,
                    std::span<std::uint8_t> blocked) const;
  void blockKept(std::size_t piece, const RayBundle& rays, std::span<std::uint8_t> blocked) const;
  void blockObjects(const RayBundle& rays, bool coherent, std::span<std::uint8_t> blocked) const;
  bool insideBehind(const Vec3f& shift, const RayBundle& rays, const RayStretch& stretch) const;
  void trace(std::size_t piece, const RayBundle& rays, std::span<const RayStretch> stretches,
             std::span<SceneHit> hits) const;

  std::vector<Piece> pieces_;
  bool hollow_;
  std::vector<std::int16_t> objectOf_;  ///< of triangles of objects_
  SmoothMesh skin_, objects_;
  std::unique_ptr<Embree> embree_;
};

}  // namespace polestar::detail
