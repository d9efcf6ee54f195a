#include "polestar/star/detail/exact_verdict.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kChunk = 4096;

// Inner coordinates below this are rounding of a coincidence; as zeros they keep the predicates' products
// away from underflow.
constexpr double kTiny = 0x1p-160;

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
    for (std::size_t i = begin; i < end; ++i) {
      Vec3 inner = verdict.frame.toInner(mesh.vertices[i]);
      for (double& x : inner) {
        if (std::abs(x) < kTiny) x = 0;
      }
      verdict.mesh.vertices[i] = inner;
    }
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

// Number of faces that a direction passes through, for the first direction that meets no edge. All faces are
// positive as seen from the origin, so a direction is inside a face when it is left of its three sides.
int countWindings(const TriMesh& inner) {
  for (std::size_t trial = 0; trial < inner.triangles.size(); ++trial) {
    const Vec3 direction = inner.corner(trial, 0) + inner.corner(trial, 1) + inner.corner(trial, 2);
    struct Count {
      int through = 0, grazing = 0;
    };
    const Count count = reduceChunks(
        inner.triangles.size(), kChunk, Count{},
        [&](std::size_t begin, std::size_t end) {
          Count part;
          for (std::size_t f = begin; f < end; ++f) {
            const Vec3 &a = inner.corner(f, 0), &b = inner.corner(f, 1), &c = inner.corner(f, 2);
            const int ab = orientDirections(a, b, direction);
            if (ab < 0) continue;
            const int bc = orientDirections(b, c, direction);
            if (bc < 0) continue;
            const int ca = orientDirections(c, a, direction);
            if (ca < 0) continue;
            ++(ab > 0 && bc > 0 && ca > 0 ? part.through : part.grazing);
          }
          return part;
        },
        [](Count a, Count b) {
          return Count{a.through + b.through, a.grazing + b.grazing};
        });
    if (count.grazing == 0) return count.through;
  }
  return 0;
}

}  // namespace

ExactVerdict judgeCenter(const TriMesh& mesh, const Vec3& center, double unit, const Context& context) {
  ExactVerdict verdict;
  verdict.frame.origin = center;
  // The given coordinates decide; scaled by a power of two, which changes no sign and keeps tiny meshes from
  // underflow.
  const double scale = 1 / unit;
  moveToInner(mesh, scale, verdict);
  const Vec3 scaledCenter = scale * center;
  const std::size_t count = mesh.triangles.size();
  std::vector<std::vector<std::int32_t>> badInChunk((count + kChunk - 1) / kChunk);
  parallelChunks(count, kChunk, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const Triangle& t = mesh.triangles[f];
      const bool inside = orientDirections(verdict.mesh.vertices[t[0]], verdict.mesh.vertices[t[1]],
                                           verdict.mesh.vertices[t[2]]) > 0 &&
                          orient3d(scale * mesh.vertices[t[0]], scale * mesh.vertices[t[1]],
                                   scale * mesh.vertices[t[2]], scaledCenter) < 0;
      if (!inside) badInChunk[begin / kChunk].push_back(static_cast<std::int32_t>(f));
    }
  });
  for (const auto& part : badInChunk) {
    verdict.badFaces.insert(verdict.badFaces.end(), part.begin(), part.end());
  }
  for (const std::int32_t f : verdict.badFaces) {
    verdict.zeroAreaFaces +=
        hasZeroArea(scale * mesh.corner(f, 0), scale * mesh.corner(f, 1), scale * mesh.corner(f, 2));
  }
  if (verdict.badFaces.empty()) verdict.windings = countWindings(verdict.mesh);
  return verdict;
}

}  // namespace polestar::detail
