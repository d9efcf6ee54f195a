#include "polestar/chart/detail/ray_zone.h"

#include <algorithm>
#include <string>

#include "polestar/chart/untangle.h"

namespace polestar::detail {
namespace {

/// Rings over which a zone fades. Each starts anew from the lines as they were.
constexpr int kWidths[] = {3, 6, 12, 24};
constexpr int kUntangleRings[] = {1, 3};
/// Share of bad cells beyond which untangling would take minutes and fail.
constexpr double kMostUntangled = 0.005;
/// Distances from the center fall at least by this share from level to level.
constexpr double kLeastFall = 1e-3;

using Vertices = std::vector<std::int32_t>;

Vertices cornersOfBadColumns(const Foliation& f) {
  std::vector<char> marked(f.vertexCount, 0);
  for (const std::size_t id : badCells(f, f.nodes)) {
    for (const std::int32_t v : f.triangles[f.triangleOf(id)]) marked[v] = 1;
  }
  Vertices result;
  for (std::size_t v = 0; v < marked.size(); ++v) {
    if (marked[v]) result.push_back(static_cast<std::int32_t>(v));
  }
  return result;
}

// Rings from the nearest seed; `farthest` + 1 beyond.
std::vector<int> ringsFrom(const Foliation& f, const std::vector<char>& seed, int farthest) {
  std::vector<int> rings(f.vertexCount, farthest + 1);
  for (std::size_t v = 0; v < seed.size(); ++v) {
    if (seed[v]) rings[v] = 0;
  }
  for (int ring = 1; ring <= farthest; ++ring) {
    std::vector<int> next = rings;
    for (const Triangle& t : f.triangles) {
      for (int k = 0; k < 3; ++k) {
        for (int j = 1; j < 3; ++j) {
          if (rings[t[k]] == ring - 1) next[t[(k + j) % 3]] = std::min(next[t[(k + j) % 3]], ring);
        }
      }
    }
    rings = std::move(next);
  }
  return rings;
}

double fade(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// The lines between field line (weight 0) and ray (weight 1), at the lines' own distances from the center.
void bend(const Foliation& lines, const std::vector<double>& weight, Foliation& result) {
  for (std::size_t v = 0; v < lines.vertexCount; ++v) {
    if (!(weight[v] > 0)) continue;
    const Vec3& q = lines.nodes[v];
    const Vec3 ray = q.normalized();
    double last = q.norm();
    for (std::size_t level = 1; level < lines.levels.size(); ++level) {
      const Vec3& x = lines.node(level, v);
      const double distance = std::min(x.norm(), last * (1 - kLeastFall));
      const Vec3 direction = weight[v] < 1 ? Vec3((1 - weight[v]) * x.normalized() + weight[v] * ray) : ray;
      result.nodes[result.nodeId(level, v)] = distance * direction.normalized();
      last = distance;
    }
  }
}

}  // namespace

RayZone bendTowardsRays(Foliation& foliation, const Context& context) {
  RayZone zone;
  const Foliation lines = foliation;
  std::vector<char> seed(lines.vertexCount, 0);
  std::vector<double> weight(lines.vertexCount, 0);
  Vertices bad = cornersOfBadColumns(foliation);
  for (const int width : kWidths) {
    if (bad.empty()) break;
    for (const std::int32_t v : bad) seed[v] = 1;
    const std::vector<int> rings = ringsFrom(lines, seed, width);
    for (std::size_t v = 0; v < weight.size(); ++v) weight[v] = fade(1.0 * (width + 1 - rings[v]) / width);
    foliation.nodes = lines.nodes;
    bend(lines, weight, foliation);
    const std::size_t left = countCells(foliation).bad();
    if (static_cast<double>(left) <= kMostUntangled * static_cast<double>(foliation.cellCount())) {
      for (const int around : kUntangleRings) untangle(foliation, around, context);
    }
    context.log(LogLevel::debug, "zones of " + std::to_string(width) + " rings from " +
                                     std::to_string(bad.size()) + " lines leave " + std::to_string(left) +
                                     " bad cells, " + std::to_string(countCells(foliation).bad()) +
                                     " once untangled");
    bad = cornersOfBadColumns(foliation);
  }
  if (!bad.empty()) {
    weight.assign(weight.size(), 1);
    foliation.nodes = lines.nodes;
    bend(lines, weight, foliation);
    zone.everywhere = true;
  }
  zone.lines =
      static_cast<std::size_t>(std::count_if(weight.begin(), weight.end(), [](double w) { return w > 0; }));
  for (std::size_t id = 0; id < foliation.nodes.size(); ++id) {
    if (foliation.nodes[id] == lines.nodes[id]) continue;
    zone.movedNodes.push_back(id);
    zone.largestMove = std::max(zone.largestMove, (foliation.nodes[id] - lines.nodes[id]).norm());
  }
  return zone;
}

}  // namespace polestar::detail
