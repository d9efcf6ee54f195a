#include "polestar/sphere/detail/sphere_quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"
#include "polestar/sphere/dilatation.h"

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
