#include "polestar/polycube/domain_surface.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "polestar/core/detail/edge_table.h"
#include "polestar/mesh/bisect.h"

namespace polestar {
namespace {

// Of a cell's face along each side, before triangles that are too wide seen from the center are cut.
constexpr int kDivisions = 2;
/// Beside reentrant corners once more: Green's function is less smooth there than at edges.
constexpr int kCornerRounds = 4;

Vec3 unitNormal(const TriMesh& mesh, std::size_t triangle) { return areaVector(mesh, triangle).normalized(); }

// Directions of the edges at each vertex where the surface turns towards its outside, as bits.
std::vector<char> reentrantAxes(const TriMesh& mesh) {
  const detail::EdgeTable edges(mesh.triangles, mesh.vertices.size());
  std::vector<char> axes(mesh.vertices.size(), 0);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    const auto first = static_cast<std::size_t>(sides[0] / 3),
               second = static_cast<std::size_t>(sides[1] / 3);
    const Vec3 away = mesh.corner(second, (sides[1] + 2) % 3) - mesh.corner(second, sides[1] % 3);
    // Faces meet at right angles or lie in one plane.
    if (unitNormal(mesh, first).dot(away) <= 1e-9 * away.norm()) continue;
    const auto [a, b] = edges.ends(e);
    int axis = 0;
    (mesh.vertices[b] - mesh.vertices[a]).cwiseAbs().maxCoeff(&axis);
    for (const std::int32_t end : {a, b}) axes[static_cast<std::size_t>(end)] |= static_cast<char>(1 << axis);
  }
  return axes;
}

// Triangles with a vertex on reentrant edges of so many directions.
std::vector<char> besideReentrant(const TriMesh& mesh, int directions) {
  const std::vector<char> axes = reentrantAxes(mesh);
  std::vector<char> marked(mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < marked.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    marked[t] = std::any_of(corners.begin(), corners.end(), [&](std::int32_t v) {
      return std::popcount(static_cast<unsigned char>(axes[static_cast<std::size_t>(v)])) >= directions;
    });
  }
  return marked;
}

}  // namespace

TriMesh domainSurface(const Polycube& polycube, int rounds) {
  TriMesh surface = polycube.surface(kDivisions);
  for (int round = 0; round < rounds; ++round)
    surface = bisectLongestEdges(surface, besideReentrant(surface, 1)).mesh;
  for (int round = 0; round < kCornerRounds; ++round)
    surface = bisectLongestEdges(surface, besideReentrant(surface, 2)).mesh;
  return surface;
}

}  // namespace polestar
