#pragma once
// Meshes and measures that the tests of the sphere stage share.

#include <span>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

/// A rotation about no axis of coordinates.
Mat3 someRotation();

/// Largest distance between two sets of directions.
double largestDifference(std::span<const Vec3> a, std::span<const Vec3> b);

/// The same after the rotation (of all directions alike) that brings `a` closest to `b`.
double largestDifferenceUpToRotation(std::span<const Vec3> a, std::span<const Vec3> b);

std::vector<Vec3> rotated(const Mat3& turn, std::span<const Vec3> directions);

/// cube(divisions) with the diagonals of its squares thrown at random: the surface and the vertices are the
/// same for every seed, the triangles are not.
TriMesh shuffledCube(int divisions, unsigned seed);

/// `mesh` with `count` new vertices in random triangles, each at the share `height` of the triangle above one
/// edge: a needle of that height. The surface does not change.
TriMesh withNeedles(TriMesh mesh, int count, double height, unsigned seed);

/// A closed ring of `sides` quadrangles with two flat lids that have no vertex inside.
TriMesh drum(int sides, double halfHeight);

}  // namespace polestar::testing
