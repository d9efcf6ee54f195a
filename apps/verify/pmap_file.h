#pragma once
// Reads what the theorem is about from a .pmap.
//
// Layout (little endian): "POLESTAR", uint32 format, uint32 length of the header, the header as JSON, zeros
// up to a multiple of 64; then the arrays, at offsets that the header names. `hash` in the header is the
// 128-bit XXH3 of the header without its hash and of all that follows the header.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "domain.h"
#include "vec3.h"

namespace polestar::verify {

using Triangle = std::array<std::int32_t, 3>;

/// Of the ball onto itself, sphere by sphere about the center, in the core by the rotation alone. On the
/// spheres further out either a Moebius transformation besides, which draws all directions towards `pull`, by
/// a share of it that rises to 1 on the surface; or a table of the sphere: triangles, and where each of their
/// vertices goes, linear between these and the rotation on the way out of the core.
struct BallMotion {
  std::array<Vec3, 3> rotation;  ///< rows
  double coreRadius = 0;
  Vec3 pull;                   ///< 0 where there is a table
  std::vector<Vec3> from, to;  ///< empty where there is none
  std::vector<Triangle> triangles;
};

/// Nodes: level * vertices.size() + vertex, levels from the surface (0) inward, and one more for the center.
struct BallMapContents {
  std::vector<Vec3> vertices;       ///< of the surface, mesh units
  std::vector<Triangle> triangles;  ///< of the surface
  std::size_t levels = 0;
  std::vector<double> radii;    ///< R of every level by Green's function
  bool radiusIsOfGreen = true;  ///< R is the radius in the ball, too, not only what decides it
  std::vector<Vec3> nodes;      ///< in the solid; inner frame: (mesh - center) / unit
  std::vector<Vec3> ball;       ///< their images in the unit ball
  /// 1 for nodes that repairs moved off their field lines: their images are of no level. Empty: none.
  std::vector<char> moved;
  Vec3 center;  ///< mesh units
  double unit = 1;
  std::size_t notFinite = 0;   ///< numbers of the file's arrays that are NaN or infinite
  std::string firstNotFinite;  ///< where
};

/// Format 4: where the map does not end in the ball.
struct DomainContents {
  Domain shape;
  BallMapContents map;  ///< of the polycube onto the ball
  BallMotion motion;    ///< from the solid's ball to the polycube's
};

struct PmapContents : BallMapContents {
  std::optional<DomainContents> domain;
};

/// @throws Unreadable for what is missing, damaged, of another format, or names what is not there.
PmapContents readPmap(const std::filesystem::path& path);

}  // namespace polestar::verify
