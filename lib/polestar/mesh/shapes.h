#pragma once
// Surfaces made by formula: the bodies that the tests hold against exact answers and that `volumes/` ships.
// All are closed, outward-oriented, of genus 0 and star-shaped, about the origin unless said otherwise.

#include <functional>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// Icosahedron subdivided `levels` times, on the unit sphere: 10 * 4^levels + 2 vertices.
TriMesh icosphere(int levels);

/// icosphere(levels) with every direction scaled by radius(direction) > 0.
TriMesh radialShape(int levels, const std::function<double(const Vec3&)>& radius);

/// Cube [-1, 1]^3 with `divisions`^2 squares a side: 6 * divisions^2 + 2 vertices.
TriMesh cube(int divisions);

/// Upper half of the unit ball: hemisphere z >= 0 and the disk below it, `rings` rings on each: about 6 *
/// rings^2 vertices. Star-shaped about points inside, such as (0, 0, 0.4).
TriMesh halfBall(int rings);

/// Smooth body with three lobes: radius 1 + 0.3 Y / max Y, Y the real spherical harmonic z (x^3 - 3 x y^2).
TriMesh smoothStar(int levels);

/// Every vertex through `move`.
TriMesh transformed(TriMesh mesh, const std::function<Vec3(const Vec3&)>& move);

}  // namespace polestar
