#pragma once
// Bodies with character, made by formula: what `volumes/` ships besides the plain shapes of shapes.h. All are
// closed, outward-oriented, of genus 0 and star-shaped about the origin.

#include <cstdint>
#include <functional>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// Every triangle cut into frequency^2 flat ones; shared edges share their new vertices.
TriMesh subdivided(const TriMesh& mesh, int frequency);

/// Icosahedron subdivided `frequency` times along its edges, on the unit sphere: 10 * frequency^2 + 2
/// vertices.
TriMesh geodesicSphere(int frequency);

/// The surface with distance radius(direction) > 0 from the origin, radius smooth, on about equilateral
/// triangles: the vertices of geodesicSphere(frequency) slide over the surface, `iterations` times, each to
/// the centroid of its triangles, weighted by their area and by density(point) > 0. Where density is k times
/// higher, edges get shorter.
TriMesh relaxedRadialShape(int frequency, const std::function<double(const Vec3&)>& radius,
                           const std::function<double(const Vec3&)>& density = {}, int iterations = 40);

/// Small stellated dodecahedron: 12 five-sided spikes of circumradius 1, flat faces: 30 * frequency^2 + 2
/// vertices.
TriMesh starPolyhedron(int frequency);

/// Ball with a smooth bump over each vertex of an icosahedron: radius 1 to 1.6, scaled to at most 1.
TriMesh twelveLobes(int frequency);

/// An asteroid: a stretched body under ridges and craters from seeded noise. Circumradius about 1.
TriMesh asteroid(int frequency, std::uint32_t seed = 1);

/// A stylized head on its neck: smoothly blended ellipsoids and cones. Looks along -y, crown along +z, height
/// about 2.3.
TriMesh stylizedHead(int frequency);

/// A pig-shaped coin box after the one in [Xia 2010, fig. 4]: a round body on four short legs, a snout, two
/// ears, the curl of a tail and a slot for coins. Looks along -y, up is +z, length about 2.1.
TriMesh coinPig(int frequency);

}  // namespace polestar
