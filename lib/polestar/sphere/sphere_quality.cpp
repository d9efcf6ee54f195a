#include "polestar/sphere/detail/sphere_quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kChunk = 4096;

}  // namespace

std::vector<std::int32_t> flippedTriangles(std::span<const Vec3> directions,
                                           const std::vector<Triangle>& triangles) {
  using Ids = std::vector<std::int32_t>;
  return reduceChunks(
      triangles.size(), kChunk, Ids{},
      [&](std::size_t begin, std::size_t end) {
        Ids flipped;
        for (std::size_t t = begin; t < end; ++t) {
          const auto& [a, b, c] = triangles[t];
          if (orientDirections(directions[a], directions[b], directions[c]) <= 0) {
            flipped.push_back(static_cast<std::int32_t>(t));
          }
        }
        return flipped;
      },
      [](Ids all, const Ids& part) {
        all.insert(all.end(), part.begin(), part.end());
        return all;
      });
}

double dilatation(const std::array<Vec3, 3>& from, const std::array<Vec3, 3>& to) {
  // Both triangles in coordinates of their own planes: first edge along x.
  auto flat = [](const std::array<Vec3, 3>& t) {
    const Vec3 e = t[1] - t[0], f = t[2] - t[0];
    const double length = e.norm();
    return std::array<double, 3>{length, e.dot(f) / length, e.cross(f).norm() / length};
  };
  const auto [x1, x2, y2] = flat(from);
  const auto [u1, u2, v2] = flat(to);
  if (!(x1 > 0 && y2 > 0 && u1 > 0 && v2 > 0)) return std::numeric_limits<double>::infinity();
  // The Jacobian is upper triangular: (a b; 0 d).
  const double a = u1 / x1, d = v2 / y2, b = (u2 - a * x2) / y2;
  // sigma_1 / sigma_2 by the sum and difference of the singular values, which cancels nothing.
  const double sum = std::hypot(a + d, b), difference = std::hypot(a - d, b);
  const double smaller = 2 * a * d / (sum + difference);
  return 0.5 * (sum + difference) / smaller;
}

Distortion angleDistortion(const TriMesh& mesh, std::span<const Vec3> directions) {
  struct Sums {
    double weighted = 0, area = 0, max = 1;
  };
  const Sums sums = reduceChunks(
      mesh.triangles.size(), kChunk, Sums{},
      [&](std::size_t begin, std::size_t end) {
        Sums part;
        for (std::size_t t = begin; t < end; ++t) {
          const auto& [a, b, c] = mesh.triangles[t];
          const double area = areaVector(mesh, t).norm();
          if (!(area > 0)) continue;
          const double qc = dilatation({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]},
                                       {directions[a], directions[b], directions[c]});
          part.weighted += area * qc;
          part.area += area;
          part.max = std::max(part.max, qc);
        }
        return part;
      },
      [](const Sums& a, const Sums& b) {
        return Sums{a.weighted + b.weighted, a.area + b.area, std::max(a.max, b.max)};
      });
  return {sums.weighted / sums.area, sums.max};
}

}  // namespace polestar::detail
