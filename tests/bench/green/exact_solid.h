#pragma once
// Solids whose Green's function is known in closed form, and the points at which all methods are compared.

#include <functional>
#include <string>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::bench {

/// Mesh units. The solid is open: `inside` is false on its surface.
struct ExactSolid {
  std::string name;
  Vec3 pole;
  Box box;
  double harmonicRadius;
  std::function<bool(const Vec3&)> inside;
  std::function<double(const Vec3&)> green;
  /// The surface with about `vertices` vertices, all of them on it.
  std::function<TriMesh(int vertices)> surface;
};

/// The unit ball with its pole off the center, the upper half of the unit ball, the cube [-1, 1]^3.
const std::vector<ExactSolid>& exactSolids();

/// @throws std::out_of_range for an unknown name.
const ExactSolid& exactSolid(const std::string& name);

/// The point of the segment from `in` (inside) to `out` (not inside) where it leaves the solid, to rounding.
Vec3 crossing(const std::function<bool(const Vec3&)>& inside, Vec3 in, Vec3 out);

/// `count` quasi-random points, always the same ones. Of every four, three are spread evenly over the volume,
/// one lies on the last 4 % of the way from the pole to the surface. None is on the last 0.4 %: polyhedra
/// inscribed in the ball have to contain them.
std::vector<Vec3> probes(const ExactSolid& solid, int count);

}  // namespace polestar::bench
