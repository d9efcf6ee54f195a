#include "polestar/green/detail/bisect.h"

#include <algorithm>
#include <map>

namespace polestar::detail {
namespace {

using Edge = std::pair<std::int32_t, std::int32_t>;

// The longest edge of triangle t. Edges of nearly the same length go by their vertices' ids: symmetric meshes are full
// of ties, and rounding must not decide them one way here and another way for a turned copy.
int longestEdge(const TriMesh& mesh, const Triangle& t) {
  constexpr double kTie = 1e-4;
  auto edge = [&](int k) { return Edge(std::minmax({t[k], t[(k + 1) % 3]})); };
  auto length = [&](int k) { return (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm(); };
  int best = 0;
  for (int k = 1; k < 3; ++k) {
    const double ratio = length(k) / length(best);
    if (ratio > 1 + kTie || (ratio > 1 - kTie && edge(k) > edge(best))) best = k;
  }
  return best;
}

}  // namespace

Refinement bisectLongestEdges(const TriMesh& mesh, const std::vector<char>& marked) {
  const std::size_t count = mesh.triangles.size();
  std::map<Edge, std::array<std::size_t, 2>> trianglesOf;
  std::vector<int> longest(count);
  for (std::size_t t = 0; t < count; ++t) {
    longest[t] = longestEdge(mesh, mesh.triangles[t]);
    for (int k = 0; k < 3; ++k) {
      const Edge edge = std::minmax({mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]});
      const auto [entry, isNew] = trianglesOf.try_emplace(edge, std::array{t, t});
      if (!isNew) entry->second[1] = t;
    }
  }

  // Close the set of cut edges: a triangle with a cut edge has its longest edge cut.
  std::map<Edge, std::int32_t> middle;
  std::vector<std::size_t> pending;
  for (std::size_t t = 0; t < count; ++t) {
    if (marked[t]) pending.push_back(t);
  }
  while (!pending.empty()) {
    const std::size_t t = pending.back();
    pending.pop_back();
    const Edge edge = std::minmax({mesh.triangles[t][longest[t]], mesh.triangles[t][(longest[t] + 1) % 3]});
    if (!middle.try_emplace(edge, -1).second) continue;
    for (const std::size_t neighbour : trianglesOf.at(edge)) pending.push_back(neighbour);
  }

  Refinement result;
  result.mesh.vertices = mesh.vertices;
  result.coarseVertices = mesh.vertices.size();
  for (auto& [edge, id] : middle) {
    id = static_cast<std::int32_t>(result.mesh.vertices.size());
    result.mesh.vertices.push_back(0.5 * (mesh.vertices[edge.first] + mesh.vertices[edge.second]));
    result.parents.push_back({edge.first, edge.second});
  }
  for (std::size_t t = 0; t < count; ++t) {
    const Triangle& corner = mesh.triangles[t];
    const std::int32_t a = corner[longest[t]], b = corner[(longest[t] + 1) % 3], c = corner[(longest[t] + 2) % 3];
    auto cut = [&](std::int32_t u, std::int32_t v) {
      const auto found = middle.find(std::minmax({u, v}));
      return found == middle.end() ? -1 : found->second;
    };
    const std::int32_t ab = cut(a, b), bc = cut(b, c), ca = cut(c, a);
    if (ab < 0) {
      result.mesh.triangles.push_back(corner);
      continue;
    }
    // Halves (a, ab, c) and (ab, b, c), each halved again where its other old edge is cut.
    if (ca < 0) {
      result.mesh.triangles.push_back({a, ab, c});
    } else {
      result.mesh.triangles.insert(result.mesh.triangles.end(), {{a, ab, ca}, {ab, c, ca}});
    }
    if (bc < 0) {
      result.mesh.triangles.push_back({ab, b, c});
    } else {
      result.mesh.triangles.insert(result.mesh.triangles.end(), {{ab, b, bc}, {ab, bc, c}});
    }
  }
  return result;
}

}  // namespace polestar::detail
