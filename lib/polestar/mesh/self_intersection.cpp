#include "polestar/mesh/self_intersection.h"

#include <algorithm>

#include "polestar/core/detail/aabb_tree.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar {
namespace {

using Corners = std::array<Vec3, 3>;

// Of three points of a plane that is not at right angles to the two axes other than `dropped`.
int orient2d(const Vec3& a, const Vec3& b, const Vec3& c, int dropped) {
  const int i = (dropped + 1) % 3, j = (dropped + 2) % 3;
  const auto flat = [&](const Vec3& p) { return Vec3(p[i], p[j], 1); };
  return orientDirections(flat(a), flat(b), flat(c));
}

bool onSegment2d(const Vec3& p, const Vec3& a, const Vec3& b, int dropped) {
  for (int k = 0; k < 3; ++k) {
    if (k != dropped && (p[k] < std::min(a[k], b[k]) || p[k] > std::max(a[k], b[k]))) return false;
  }
  return true;
}

bool segmentsMeet2d(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, int dropped) {
  const int ofA = orient2d(p, q, a, dropped), ofB = orient2d(p, q, b, dropped),
            ofP = orient2d(a, b, p, dropped), ofQ = orient2d(a, b, q, dropped);
  if (ofA * ofB < 0 && ofP * ofQ < 0) return true;
  return (ofA == 0 && onSegment2d(a, p, q, dropped)) || (ofB == 0 && onSegment2d(b, p, q, dropped)) ||
         (ofP == 0 && onSegment2d(p, a, b, dropped)) || (ofQ == 0 && onSegment2d(q, a, b, dropped));
}

int steepestAxis(const Corners& t) {
  int axis = 0;
  (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs().maxCoeff(&axis);
  return axis;
}

bool contains2d(const Corners& t, const Vec3& p, int dropped) {
  const int turn = orient2d(t[0], t[1], t[2], dropped);
  for (int k = 0; k < 3; ++k) {
    if (orient2d(t[k], t[(k + 1) % 3], p, dropped) * turn < 0) return false;
  }
  return true;
}

// The closed segment and the closed triangle.
bool meets(const Vec3& p, const Vec3& q, const Corners& t) {
  const int ofP = orient3d(t[0], t[1], t[2], p), ofQ = orient3d(t[0], t[1], t[2], q);
  if (ofP * ofQ > 0) return false;
  if (ofP == 0 && ofQ == 0) {
    const int dropped = steepestAxis(t);
    if (contains2d(t, p, dropped)) return true;
    for (int k = 0; k < 3; ++k) {
      if (segmentsMeet2d(p, q, t[k], t[(k + 1) % 3], dropped)) return true;
    }
    return false;
  }
  bool positive = false, negative = false;
  for (int k = 0; k < 3; ++k) {
    const int side = orient3d(p, q, t[k], t[(k + 1) % 3]);
    positive = positive || side > 0;
    negative = negative || side < 0;
  }
  return !(positive && negative);
}

// Beyond the corners that the triangles share.
bool intersect(const TriMesh& mesh, std::size_t first, std::size_t second) {
  const auto corners = [&](std::size_t t) {
    return Corners{mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
  };
  const std::array triangles{mesh.triangles[first], mesh.triangles[second]};
  const std::array places{corners(first), corners(second)};
  std::array<std::array<bool, 3>, 2> shared{};
  int common = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (triangles[0][i] != triangles[1][j]) continue;
      shared[0][i] = shared[1][j] = true;
      ++common;
    }
  }
  if (common == 3) return true;
  const auto apart = [&](int side) {
    return static_cast<int>(std::find(shared[side].begin(), shared[side].end(), false) -
                            shared[side].begin());
  };
  if (common == 2) {
    // They meet in more than their edge when one lies folded back onto the other.
    const Corners& t = places[0];
    const int own = apart(0);
    const Vec3& other = places[1][apart(1)];
    if (orient3d(t[0], t[1], t[2], other) != 0) return false;
    const int dropped = steepestAxis(t);
    const Vec3 &a = t[(own + 1) % 3], &b = t[(own + 2) % 3];
    return orient2d(a, b, t[own], dropped) * orient2d(a, b, other, dropped) >= 0;
  }
  for (int side = 0; side < 2; ++side) {
    for (int k = 0; k < 3; ++k) {
      // With a common corner only the edge across from it can meet the other triangle elsewhere.
      if (common == 1 && (shared[side][k] || shared[side][(k + 1) % 3])) continue;
      if (meets(places[side][k], places[side][(k + 1) % 3], places[1 - side])) return true;
    }
  }
  return false;
}

}  // namespace

SelfIntersections findSelfIntersections(const TriMesh& mesh) {
  std::vector<detail::Bounds> boxes(mesh.triangles.size());
  for (std::size_t t = 0; t < boxes.size(); ++t) {
    for (int k = 0; k < 3; ++k) boxes[t].include(mesh.corner(t, k));
  }
  const detail::AabbTree tree(boxes);
  const auto combine = [](SelfIntersections all, const SelfIntersections& part) {
    all.pairs += part.pairs;
    if (!all.first) all.first = part.first;
    return all;
  };
  return detail::reduceChunks(
      boxes.size(), 256, SelfIntersections{},
      [&](std::size_t begin, std::size_t end) {
        SelfIntersections part;
        for (std::size_t t = begin; t < end; ++t) {
          std::size_t least = boxes.size();
          tree.visitOverlapping(boxes[t], [&](std::size_t other) {
            if (other <= t || !boxes[other].overlaps(boxes[t]) || !intersect(mesh, t, other)) return false;
            ++part.pairs;
            least = std::min(least, other);
            return false;
          });
          if (least < boxes.size() && !part.first) part.first = {t, least};
        }
        return part;
      },
      combine);
}

}  // namespace polestar
