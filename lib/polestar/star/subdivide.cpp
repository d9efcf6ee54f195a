#include "polestar/star/subdivide.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "polestar/core/error.h"
#include "polestar/mesh/bisect.h"

namespace polestar {
namespace {

double angleBetween(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

std::vector<char> tooWide(const TriMesh& mesh, const Vec3& center, double largestAngle) {
  std::vector<char> marked(mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < marked.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = mesh.corner(t, k) - center, b = mesh.corner(t, (k + 1) % 3) - center;
      if (angleBetween(a, b) > largestAngle) marked[t] = 1;
    }
  }
  return marked;
}

// Nothing where rounding hides the center.
std::optional<StarShape> aboutSameCenter(const StarShape& shape, TriMesh mesh) {
  StarOptions options;
  options.center = shape.frame().origin;
  options.rays = 0;
  try {
    return verifyStarShape(verifyClosedSurface(std::move(mesh)), options);
  } catch (const Error& error) {
    if (error.code() != Errc::notStarShaped && error.code() != Errc::invalidSurface) throw;
    return std::nullopt;
  }
}

}  // namespace

StarShape subdivide(const StarShape& shape, double largestAngle, Context& context) {
  TriMesh mesh = shape.surface().mesh();
  const std::size_t before = mesh.vertices.size();
  const Vec3 center = shape.frame().origin;
  for (;;) {
    context.throwIfCancelled();
    const std::vector<char> marked = tooWide(mesh, center, largestAngle);
    if (std::find(marked.begin(), marked.end(), 1) == marked.end()) break;
    mesh = bisectLongestEdges(mesh, marked).mesh;
  }
  if (mesh.vertices.size() == before) return shape;
  const std::size_t after = mesh.vertices.size();
  std::optional<StarShape> finer = aboutSameCenter(shape, std::move(mesh));
  if (!finer) return shape;
  context.log(LogLevel::info, "the map's table has " + std::to_string(after) + " vertices on the surface, " +
                                  std::to_string(after - before) +
                                  " more than the mesh: its triangles are wide");
  return *finer;
}

std::optional<RefinedShape> bisect(const StarShape& shape, const std::vector<char>& marked) {
  Refinement refinement = bisectLongestEdges(shape.surface().mesh(), marked);
  std::optional<StarShape> finer = aboutSameCenter(shape, std::move(refinement.mesh));
  if (!finer) return std::nullopt;
  return RefinedShape{*std::move(finer), std::move(refinement.parents)};
}

}  // namespace polestar
