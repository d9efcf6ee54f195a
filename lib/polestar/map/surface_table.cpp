#include "polestar/map/surface_table.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "polestar/core/error.h"
#include "polestar/core/predicates.h"
#include "polestar/map/detail/surface_rays.h"

namespace polestar {
namespace {

constexpr std::size_t kMostNamed = 5;  // triangles, where there are more

std::string at(const Vec3& point) {
  std::ostringstream text;
  text.precision(6);
  text << point.x() << ' ' << point.y() << ' ' << point.z();
  return text.str();
}

/// Where the vertices go on the sphere. `which`: "first" or "second", for messages.
std::vector<Vec3> onSphere(const BallMap& map, const TriMesh& mesh, double reach, const char* which) {
  const StarShape& shape = map.chart().green().shape();
  const Vec3& center = shape.frame().origin;
  std::vector<Vec3> rays;
  for (const Vec3& vertex : mesh.vertices) rays.push_back(vertex - center);
  const std::vector<detail::RayExit> exits = detail::rayExits(map, rays);
  const double allowed = reach * boundingBox(shape.surface().mesh()).diagonal();
  std::vector<Vec3> directions;
  std::size_t off = 0, worst = 0;
  double farthest = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    directions.push_back(exits[i].direction);
    // Written so that what is no number counts as off.
    const double miss = std::abs(rays[i].norm() - exits[i].distance);
    if (miss <= allowed) continue;
    ++off;
    if (miss <= farthest) continue;
    farthest = miss, worst = i;
  }
  if (off == 0) return directions;
  std::ostringstream message;
  message.precision(3);
  message << "surface map: " << off << " of " << rays.size() << " vertices of the " << which
          << " mesh are off the surface of the " << which << " solid; number " << worst
          << ", counted from 0, at " << at(mesh.vertices[worst]) << " by " << farthest << ", where "
          << allowed << " is allowed; are the units and places those of the solid?";
  throw Error(Errc::usage, message.str());
}

std::string named(std::span<const std::size_t> triangles, const TriMesh& mesh) {
  std::string text;
  for (const std::size_t t : triangles.first(std::min(triangles.size(), kMostNamed))) {
    text += text.empty() ? "" : ", ";
    text += std::to_string(t) + " at " + at((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3);
  }
  return text + (triangles.size() > kMostNamed ? " ..." : "");
}

void refuse(std::span<const std::size_t> folded, const TriMesh& mesh, const std::string& where) {
  if (folded.empty()) return;
  throw Error(Errc::notConverged, "surface map: " + std::to_string(folded.size()) + " of " +
                                      std::to_string(mesh.triangles.size()) + " triangles " + where + ": " +
                                      named(folded, mesh) + " (counted from 0, places on the first solid)");
}

void refuseFolds(const ShellTable& table, const TriMesh& mesh) {
  std::vector<std::size_t> first, second, between;
  for (std::size_t t = 0; t < table.triangles.size(); ++t) {
    const auto& [a, b, c] = table.triangles[t];
    if (orientDirections(table.from[a], table.from[b], table.from[c]) <= 0) first.push_back(t);
  }
  refuse(first, mesh, "are turned over or flat on the first solid itself");
  for (const FoldedTriangle& folded : foldedTriangles(table, coreRotation(table)))
    (folded.share == 1 ? second : between).push_back(static_cast<std::size_t>(folded.triangle));
  refuse(second, mesh, "are turned over or flat on the second solid");
  refuse(between, mesh, "turn over on the way to a rotation in the core, so far are they turned");
}

}  // namespace

void SurfaceTableOptions::validate() const {
  if (!(reach >= 0 && std::isfinite(reach)))
    throw Error(Errc::usage, "SurfaceTableOptions: the reach must be a finite number from 0");
}

ShellMap surfaceTable(const BallMap& from, const TriMesh& onFrom, const BallMap& to, const TriMesh& onTo,
                      const SurfaceTableOptions& options) {
  options.validate();
  if (onFrom.vertices.size() != onTo.vertices.size() || onFrom.triangles != onTo.triangles) {
    throw Error(Errc::usage, "surface map: the two meshes do not have the same triangles (" +
                                 std::to_string(onFrom.vertices.size()) + " vertices and " +
                                 std::to_string(onFrom.triangles.size()) + " triangles, " +
                                 std::to_string(onTo.vertices.size()) + " and " +
                                 std::to_string(onTo.triangles.size()) + ")");
  }
  ShellTable table{onSphere(from, onFrom, options.reach, "first"),
                   onSphere(to, onTo, options.reach, "second"), onFrom.triangles};
  refuseFolds(table, onFrom);
  return ShellMap(std::move(table), options.coreRadius);
}

}  // namespace polestar
