#include "polestar/core/covering_number.h"

#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar {
namespace {

constexpr std::size_t kChunk = 4096;

/// Sign of det[d, b, c], d = (1, e, e^2): the first component of b x c that is not 0. None is only where b
/// and c are parallel, and no cone over them has an inside.
int sideOf(const Vec3& b, const Vec3& c) {
  for (int axis = 0; axis < 3; ++axis) {
    if (const int side = orientDirections(Vec3::Unit(axis), b, c)) return side;
  }
  return 0;
}

/// 1 or -1 where the cone over the triangle holds d, by its orientation; else 0.
int coneOver(const Vec3& a, const Vec3& b, const Vec3& c) {
  const int side = sideOf(a, b);
  if (side == 0 || sideOf(b, c) != side || sideOf(c, a) != side) return 0;
  // On the same side of all three: in the cone, or in the opposite one, of a triangle that turns the other
  // way.
  return orientDirections(a, b, c) == side ? side : 0;
}

}  // namespace

int coveringNumber(std::span<const Vec3> vertices, const std::vector<Triangle>& triangles) {
  return detail::reduceChunks(
      triangles.size(), kChunk, 0,
      [&](std::size_t begin, std::size_t end) {
        int sum = 0;
        for (std::size_t t = begin; t < end; ++t) {
          const auto& [a, b, c] = triangles[t];
          sum += coneOver(vertices[a], vertices[b], vertices[c]);
        }
        return sum;
      },
      [](int x, int y) { return x + y; });
}

}  // namespace polestar
