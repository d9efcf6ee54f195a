#include "polestar/mesh/tet_orientation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar {
namespace {

constexpr std::size_t kChunk = 1024;

void note(TetSigns& signs, int sign) {
  ++(sign > 0 ? signs.positive : sign < 0 ? signs.negative : signs.flat);
}

TetQuality summarize(std::vector<double> ratios) {
  TetQuality quality;
  if (ratios.empty()) return quality;
  double sum = 0;
  for (const double ratio : ratios) sum += ratio;
  quality.mean = sum / static_cast<double>(ratios.size());
  const auto rank = ratios.begin() + static_cast<std::ptrdiff_t>((ratios.size() - 1) / 100);
  std::nth_element(ratios.begin(), rank, ratios.end());
  quality.onePercent = *rank;
  quality.least = *std::min_element(ratios.begin(), rank + 1);
  return quality;
}

}  // namespace

double meanRatio(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = c - a, w = d - a;
  const double edges = u.squaredNorm() + v.squaredNorm() + w.squaredNorm() + (v - u).squaredNorm() +
                       (w - u).squaredNorm() + (w - v).squaredNorm();
  if (!(edges > 0)) return 0;
  const double sixfold = std::abs(u.cross(v).dot(w));
  return 12 * std::cbrt(0.25 * sixfold * sixfold) / edges;
}

std::vector<char> boundaryVertices(std::span<const Tetrahedron> tetrahedra, std::size_t vertexCount) {
  constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
  std::vector<std::array<std::int32_t, 3>> faces;
  faces.reserve(4 * tetrahedra.size());
  for (const Tetrahedron& t : tetrahedra) {
    for (const auto& corners : kFaces) {
      std::array<std::int32_t, 3> face{t[corners[0]], t[corners[1]], t[corners[2]]};
      std::sort(face.begin(), face.end());
      faces.push_back(face);
    }
  }
  std::sort(faces.begin(), faces.end());
  std::vector<char> boundary(vertexCount, 0);
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t next = i + 1;
    while (next < faces.size() && faces[next] == faces[i]) ++next;
    if (next == i + 1) {
      for (const std::int32_t vertex : faces[i]) boundary[vertex] = 1;
    }
    i = next;
  }
  return boundary;
}

TetReport compareTetrahedra(std::span<const Tetrahedron> tetrahedra, std::span<const Vec3> before,
                            std::span<const Vec3> after) {
  const std::size_t count = tetrahedra.size();
  std::vector<std::array<int, 2>> signs(count);
  std::vector<double> ratiosBefore(count), ratiosAfter(count);
  detail::parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto [a, b, c, d] = tetrahedra[t];
      signs[t] = {orient3d(before[a], before[b], before[c], before[d]),
                  orient3d(after[a], after[b], after[c], after[d])};
      ratiosBefore[t] = meanRatio(before[a], before[b], before[c], before[d]);
      ratiosAfter[t] = meanRatio(after[a], after[b], after[c], after[d]);
      if (signs[t][0] * signs[t][1] < 0) ratiosAfter[t] = -ratiosAfter[t];
    }
  });

  const std::vector<char> boundary = boundaryVertices(tetrahedra, before.size());
  TetReport report;
  report.tetrahedra = count;
  for (std::size_t t = 0; t < count; ++t) {
    note(report.before, signs[t][0]);
    note(report.after, signs[t][1]);
    const bool onBoundary = std::all_of(tetrahedra[t].begin(), tetrahedra[t].end(),
                                        [&](std::int32_t vertex) { return boundary[vertex] != 0; });
    report.onBoundary += onBoundary;
    const bool turned = signs[t][0] * signs[t][1] < 0, flattened = signs[t][0] != 0 && signs[t][1] == 0;
    report.turned += turned;
    report.flattened += flattened;
    report.turnedOnBoundary += turned && onBoundary;
    report.flattenedOnBoundary += flattened && onBoundary;
    if (turned || flattened) report.bad.push_back(t);
  }
  report.qualityBefore = summarize(std::move(ratiosBefore));
  report.qualityAfter = summarize(std::move(ratiosAfter));
  return report;
}

}  // namespace polestar
