#include "polestar/polycube/domain_surface.h"

#include <algorithm>
#include <vector>

#include "polestar/core/detail/edge_table.h"
#include "polestar/mesh/bisect.h"

namespace polestar {
namespace {

// Of a cell's face along each side, before triangles that are too wide seen from the center are cut.
constexpr int kDivisions = 2;

Vec3 unitNormal(const TriMesh& mesh, std::size_t triangle) { return areaVector(mesh, triangle).normalized(); }

// Triangles with a vertex on an edge where the surface turns towards its outside.
std::vector<char> besideReentrantEdges(const TriMesh& mesh) {
  const detail::EdgeTable edges(mesh.triangles, mesh.vertices.size());
  std::vector<char> onEdge(mesh.vertices.size(), 0);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    const auto first = static_cast<std::size_t>(sides[0] / 3),
               second = static_cast<std::size_t>(sides[1] / 3);
    const Vec3 away = mesh.corner(second, (sides[1] + 2) % 3) - mesh.corner(second, sides[1] % 3);
    // Faces meet at right angles or lie in one plane.
    if (unitNormal(mesh, first).dot(away) <= 1e-9 * away.norm()) continue;
    for (const std::int32_t end : edges.ends(e)) onEdge[static_cast<std::size_t>(end)] = 1;
  }
  std::vector<char> marked(mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < marked.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    marked[t] = std::any_of(corners.begin(), corners.end(),
                            [&](std::int32_t v) { return onEdge[static_cast<std::size_t>(v)] != 0; });
  }
  return marked;
}

}  // namespace

TriMesh domainSurface(const Polycube& polycube, int rounds) {
  TriMesh surface = polycube.surface(kDivisions);
  for (int round = 0; round < rounds; ++round)
    surface = bisectLongestEdges(surface, besideReentrantEdges(surface)).mesh;
  return surface;
}

}  // namespace polestar
