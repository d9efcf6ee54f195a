#include "polestar/mesh/bisect.h"

#include <algorithm>

#include "polestar/core/detail/edge_table.h"

namespace polestar {
namespace {

// The edges of a triangle that count as its longest. Symmetric meshes are full of ties; neither rounding nor
// the order of vertices in a file may decide them, else a turned or renumbered copy would get another
// refinement. So edges of nearly the same length are cut together.
std::array<bool, 3> longestEdges(const TriMesh& mesh, const Triangle& t) {
  constexpr double kTie = 1e-4;
  std::array<double, 3> length;
  for (int k = 0; k < 3; ++k) length[k] = (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm();
  const double longest = *std::max_element(length.begin(), length.end());
  std::array<bool, 3> result;
  for (int k = 0; k < 3; ++k) result[k] = length[k] > (1 - kTie) * longest;
  return result;
}

// The pieces of one triangle. `longest` marks its longest edges, middle[k] is the vertex on edge k or -1;
// when any edge is cut, the longest ones are.
void cutTriangle(const Triangle& corner, const std::array<bool, 3>& longest,
                 const std::array<std::int32_t, 3>& middle, std::vector<Triangle>& pieces) {
  const auto cuts = std::count_if(middle.begin(), middle.end(), [](std::int32_t m) { return m >= 0; });
  const auto ties = std::count(longest.begin(), longest.end(), true);
  if (cuts == 0) {
    pieces.push_back(corner);
    return;
  }
  if (cuts == 3 && ties > 1) {
    for (int k = 0; k < 3; ++k) pieces.push_back({corner[k], middle[k], middle[(k + 2) % 3]});
    pieces.push_back({middle[0], middle[1], middle[2]});
    return;
  }
  // The longest edge first; of two, the one that comes first counter-clockwise.
  int first = static_cast<int>(std::find(longest.begin(), longest.end(), true) - longest.begin());
  if (ties == 2 && longest[(first + 2) % 3]) first = (first + 2) % 3;
  const std::int32_t a = corner[first], b = corner[(first + 1) % 3], c = corner[(first + 2) % 3];
  const std::int32_t ab = middle[first], bc = middle[(first + 1) % 3], ca = middle[(first + 2) % 3];
  // Halves (a, ab, c) and (ab, b, c), each halved again where its other old edge is cut.
  if (ca < 0) {
    pieces.push_back({a, ab, c});
  } else {
    pieces.insert(pieces.end(), {{a, ab, ca}, {ab, c, ca}});
  }
  if (bc < 0) {
    pieces.push_back({ab, b, c});
  } else {
    pieces.insert(pieces.end(), {{ab, b, bc}, {ab, bc, c}});
  }
}

}  // namespace

Refinement bisectLongestEdges(const TriMesh& mesh, const std::vector<char>& marked) {
  const std::size_t count = mesh.triangles.size();
  const detail::EdgeTable edges(mesh.triangles, mesh.vertices.size());
  std::vector<std::array<bool, 3>> longest(count);
  for (std::size_t t = 0; t < count; ++t) longest[t] = longestEdges(mesh, mesh.triangles[t]);

  // Close the set of cut edges: a triangle with a cut edge has its longest edges cut.
  constexpr std::int32_t kWhole = -1, kCut = -2;
  std::vector<std::int32_t> middle(edges.size(), kWhole);
  std::vector<std::size_t> pending;
  for (std::size_t t = 0; t < count; ++t) {
    if (marked[t]) pending.push_back(t);
  }
  while (!pending.empty()) {
    const std::size_t t = pending.back();
    pending.pop_back();
    for (int k = 0; k < 3; ++k) {
      const std::int32_t edge = edges.edgeOf(3 * t + k);
      if (!longest[t][k] || middle[edge] == kCut) continue;
      middle[edge] = kCut;
      for (const std::int32_t side : edges.sides(edge)) pending.push_back(side / 3);
    }
  }

  Refinement result;
  result.mesh.vertices = mesh.vertices;
  result.coarseVertices = mesh.vertices.size();
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (middle[e] != kCut) continue;
    const auto& [a, b] = edges.ends(e);
    middle[e] = static_cast<std::int32_t>(result.mesh.vertices.size());
    result.mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    result.parents.push_back({a, b});
  }
  for (std::size_t t = 0; t < count; ++t) {
    std::array<std::int32_t, 3> onEdge;
    for (int k = 0; k < 3; ++k) onEdge[k] = middle[edges.edgeOf(3 * t + k)];
    cutTriangle(mesh.triangles[t], longest[t], onEdge, result.mesh.triangles);
    result.triangleParents.resize(result.mesh.triangles.size(), static_cast<std::uint32_t>(t));
  }
  return result;
}

}  // namespace polestar
