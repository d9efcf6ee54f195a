#pragma once
// Bodies whose kernel is known in closed form, and bodies that have none for a known reason.

#include <cstdint>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

/// Eight pyramids on the faces of the octahedron |x| + |y| + |z| <= 1, tips at (+-1, +-1, +-1). Its 24 faces
/// lie in the octahedron's planes, which is its kernel: largest margin 1/sqrt(3), at the origin.
TriMesh stellaOctangula();

/// The letter U, 3 x 3 x 1 with a slot 1 < x < 2, y > 1: the slot's left wall wants x < 1 and its right wall
/// x > 2, so the largest margin is -1/2.
struct LetterU {
  TriMesh mesh;
  std::vector<std::int32_t> leftWall, rightWall;
};
LetterU letterU();

/// Double pyramid whose equator runs twice around the axis, at radii that keep its vertices apart. Closed,
/// manifold, of genus 0, every face's half-space holds the origin, and still no boundary of a star-shaped
/// solid: each ray from the origin meets it twice.
TriMesh twiceAround();

/// Cube [-1, 1]^3 with one corner pulled to a needle of the given length along (1, 1, 1).
TriMesh spikedCube(double length);

}  // namespace polestar::testing
