#include "polestar/green/detail/inside_star.h"

#include <algorithm>

namespace polestar::detail {

InsideStar::InsideStar(const TriMesh& mesh) : mesh_(mesh) {
  std::vector<Bounds> caps(mesh.triangles.size());
  for (std::size_t t = 0; t < caps.size(); ++t) {
    const Vec3 a = mesh.corner(t, 0).normalized(), b = mesh.corner(t, 1).normalized(),
               c = mesh.corner(t, 2).normalized();
    // A cap narrower than a hemisphere is convex on the sphere: it covers the triangle when it covers its
    // corners. All of its points are as near to its middle as the corners.
    const Vec3 middle = (a + b + c).normalized();
    const double squared =
        std::max({(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()});
    const Vec3 radius = Vec3::Constant(squared < 2 ? std::sqrt(squared) + 1e-12 : 2);
    caps[t].include(middle - radius);
    caps[t].include(middle + radius);
  }
  directions_ = AabbTree(caps);
}

bool InsideStar::contains(const Vec3& point) const {
  const double distance = point.norm();
  if (distance == 0) return true;
  const Vec3 direction = point / distance;
  double best = -1;  // how far within its cone the direction lies
  bool inside = false;
  directions_.visitContaining(direction, [&](std::size_t t) {
    const Vec3 &a = mesh_.corner(t, 0), &b = mesh_.corner(t, 1), &c = mesh_.corner(t, 2);
    const Vec3 ab = a.cross(b), bc = b.cross(c), ca = c.cross(a);
    const double depth = std::min(
        {ab.dot(direction) / ab.norm(), bc.dot(direction) / bc.norm(), ca.dot(direction) / ca.norm()});
    if (depth > best) {
      best = depth;
      inside = areaVector(mesh_, t).dot(point - a) < 0;
    }
    return false;
  });
  return inside;
}

}  // namespace polestar::detail
