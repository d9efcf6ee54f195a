#include "star/bodies.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "polestar/mesh/shapes.h"

namespace polestar::testing {

TriMesh stellaOctangula() {
  TriMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) mesh.vertices.push_back(sign * Vec3::Unit(axis));
  }
  for (int octant = 0; octant < 8; ++octant) {
    const int x = octant & 1, y = octant >> 1 & 1, z = octant >> 2;
    std::array<std::int32_t, 3> base{x, 2 + y, 4 + z};
    if ((x + y + z) % 2) std::swap(base[1], base[2]);
    const auto tip = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.push_back(Vec3(1 - 2 * x, 1 - 2 * y, 1 - 2 * z));
    for (int k = 0; k < 3; ++k) mesh.triangles.push_back({base[k], base[(k + 1) % 3], tip});
  }
  return mesh;
}

LetterU letterU() {
  const std::vector<Vec3> outline{{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {2, 3, 0},
                                  {2, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  const std::vector<Triangle> cap{{0, 1, 4}, {0, 4, 5}, {1, 2, 3}, {1, 3, 4}, {0, 5, 6}, {0, 6, 7}};
  LetterU u;
  for (const double z : {0.0, 1.0}) {
    for (const Vec3& p : outline) u.mesh.vertices.push_back(p + z * Vec3::UnitZ());
  }
  for (const Triangle& t : cap) {
    u.mesh.triangles.push_back({t[0], t[2], t[1]});
    u.mesh.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  }
  for (std::int32_t i = 0; i < 8; ++i) {
    const std::int32_t j = (i + 1) % 8;
    const auto first = static_cast<std::int32_t>(u.mesh.triangles.size());
    u.mesh.triangles.push_back({i, j, j + 8});
    u.mesh.triangles.push_back({i, j + 8, i + 8});
    if (i == 3) u.rightWall = {first, first + 1};
    if (i == 5) u.leftWall = {first, first + 1};
  }
  return u;
}

TriMesh twiceAround() {
  constexpr int kSides = 14;
  TriMesh mesh;
  mesh.vertices = {{0, 0, 1}, {0, 0, -1}};
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * 2 * std::numbers::pi * (i + 0.5) / kSides;
    const double radius = 1 + 0.3 * std::cos(angle / 2);
    mesh.vertices.push_back(Vec3(radius * std::cos(angle), radius * std::sin(angle), 0));
  }
  for (std::int32_t i = 0; i < kSides; ++i) {
    const std::int32_t a = 2 + i, b = 2 + (i + 1) % kSides;
    mesh.triangles.push_back({a, b, 0});
    mesh.triangles.push_back({b, a, 1});
  }
  return mesh;
}

TriMesh spikedCube(double length) {
  return transformed(cube(4), [&](const Vec3& v) {
    return v == Vec3(1, 1, 1) ? Vec3(v + length * Vec3(1, 1, 1).normalized()) : v;
  });
}

}  // namespace polestar::testing
