#include "polestar/star/detail/exact_verdict.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "polestar/core/covering_number.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kChunk = 4096;

void moveToInner(const TriMesh& mesh, double scale, ExactVerdict& verdict) {
  const std::size_t count = mesh.vertices.size();
  const Vec3& center = verdict.frame.origin;
  const double farthestSquared = reduceChunks(
      count, kChunk, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double largest = 0;
        for (std::size_t i = begin; i < end; ++i) {
          largest = std::max(largest, (scale * (mesh.vertices[i] - center)).squaredNorm());
        }
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
  verdict.frame.unit = farthestSquared > 0 ? std::sqrt(farthestSquared) / scale : 1;
  verdict.mesh.triangles = mesh.triangles;
  verdict.mesh.vertices.resize(count);
  parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      verdict.mesh.vertices[i] = verdict.frame.toInner(mesh.vertices[i]);
  });
}

bool hasZeroArea(const Vec3& a, const Vec3& b, const Vec3& c) {
  // Collinear exactly when the triangle is degenerate in all three coordinate planes.
  for (int k = 0; k < 3; ++k) {
    Vec3 p = a, q = b, r = c;
    p[k] = q[k] = r[k] = 1;
    if (orientDirections(p, q, r) != 0) return false;
  }
  return true;
}

}  // namespace

ExactVerdict judgeCenter(const TriMesh& mesh, const Vec3& center, double unit, const Context& context) {
  ExactVerdict verdict;
  verdict.frame.origin = center;
  moveToInner(mesh, 1 / unit, verdict);
  const std::size_t count = mesh.triangles.size();
  std::vector<std::vector<std::int32_t>> badInChunk((count + kChunk - 1) / kChunk);
  parallelChunks(count, kChunk, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const Triangle& t = mesh.triangles[f];
      const bool inside = orientDirections(verdict.mesh.vertices[t[0]], verdict.mesh.vertices[t[1]],
                                           verdict.mesh.vertices[t[2]]) > 0 &&
                          orient3d(mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2), center) < 0;
      if (!inside) badInChunk[begin / kChunk].push_back(static_cast<std::int32_t>(f));
    }
  });
  for (const auto& part : badInChunk) {
    verdict.badFaces.insert(verdict.badFaces.end(), part.begin(), part.end());
  }
  for (const std::int32_t f : verdict.badFaces) {
    verdict.zeroAreaFaces += hasZeroArea(mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2));
  }
  if (verdict.badFaces.empty())
    verdict.windings = coveringNumber(verdict.mesh.vertices, verdict.mesh.triangles);
  return verdict;
}

}  // namespace polestar::detail
