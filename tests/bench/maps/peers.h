#pragma once
// Where the methods send the vertices of one mesh of tetrahedra (inner frame, those on the surface first and
// in its order). All but the cone have our conformal map on the surface.

#include <span>
#include <vector>

#include "polestar/map/ball_map.h"
#include "tet_mesh.h"

namespace polestar::bench {

/// By forward() inside, by the sphere map on the surface.
/// @throws std::runtime_error when the map has no value at a vertex inside.
std::vector<Vec3> imagesByMap(const TetMesh& mesh, const BallMap& map);

/// x over the distance of the surface in its direction: the map that the star test itself makes one to one.
std::vector<Vec3> imagesByCone(const TetMesh& mesh, const TriMesh& surface);

/// Three harmonic functions, piecewise linear (cotangents), with `boundary` on the surface: the volumetric
/// harmonic map that the paper compares itself with. [Xia 2010, sec. 5; Wang et al. 2004]
std::vector<Vec3> imagesByHarmonicMap(const TetMesh& mesh, std::span<const Vec3> boundary);

}  // namespace polestar::bench
