#pragma once
// The solid that the picture shows: a closed surface minus a convex region (the intersection of half-spaces),
// which the cut takes away. Rays are Embree's; what the cut adds is arithmetic on their intervals.

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

struct Ray {
  Vec3 origin, direction;  ///< direction of unit length
};

/// Points x with normal . x > offset are on the plane's outer side.
struct Plane {
  Vec3 normal = Vec3::UnitZ();
  double offset = 0;
};

enum class HitKind : std::uint8_t { none, skin, cut };

struct SolidHit {
  HitKind kind = HitKind::none;
  int plane = -1;  ///< of a cut: which one
  double distance = std::numeric_limits<double>::infinity();
  Vec3 position = Vec3::Zero();
  Vec3 normal = Vec3::Zero();         ///< geometric, towards the outside
  Vec3 shadingNormal = Vec3::Zero();  ///< interpolated within creases
  Vec3 shadowOrigin =
      Vec3::Zero();  ///< where shadow rays start: clear of the facets that a curved surface stands for
};

/// Immutable after construction; every query may be called from many threads. Coordinates of about unit size.
class CutScene {
 public:
  /// What lies on the outer side of every plane is cut away; no planes: nothing is.
  /// @throws Error{Errc::io} when Embree cannot start.
  CutScene(TriMesh surface, std::vector<Plane> planes, double creaseAngle);
  ~CutScene();
  CutScene(CutScene&&) noexcept;

  /// First point of the solid that is left. The ray must start outside the solid.
  SolidHit firstHit(const Ray& ray) const;

  /// Does the solid that is left lie between `ray.origin` (on its surface or outside) and infinity?
  bool occluded(const Ray& ray) const;

  bool cutAway(const Vec3& point) const;
  const TriMesh& surface() const { return surface_; }

 private:
  struct Embree;
  struct Interval {
    double begin, end;  ///< empty unless begin < end
    int exitPlane;
    bool empty() const { return !(begin < end); }
  };
  Interval cutInterval(const Ray& ray) const;
  SolidHit skinHit(const Ray& ray, double nearest, double farthest, bool& facesAway) const;

  TriMesh surface_;
  std::vector<Plane> planes_;
  std::vector<std::array<Vec3, 3>> cornerNormals_;
  std::unique_ptr<Embree> embree_;
};

}  // namespace polestar::detail
