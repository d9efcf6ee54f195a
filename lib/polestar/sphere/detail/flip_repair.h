#pragma once
// Turns over what a conformal map of a coarse or needle-ridden mesh left upside down, near the place and
// nowhere else.

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

struct RepairOutcome {
  bool repaired = false;         ///< no flips are left
  bool crowded = false;          ///< triangles' images are too small for double precision: nothing was tried
  std::size_t freeVertices = 0;  ///< how many could move
};

/// Tries to make every triangle positively oriented by moving only the vertices within `rings` edges of a
/// flipped one; the others stay where they are to the last bit. `directions` is only changed when that
/// succeeds.
///
/// Minimizes the sum of d / a over the triangles at those vertices, weighted by their area on the surface: d
/// the image's Dirichlet energy, a its signed area. That is the MIPS measure, 1 where the map is conformal
/// and infinite where it degenerates [Hormann, Greiner 2000]. First with a regularized 1 / a until no
/// triangle is flipped [Garanzha et al. 2021], then with the barrier itself, which no accepted step passes,
/// down to its minimum.
///
/// `areaShares`: vertexAreaShares(mesh). Serial; some hundred passes over the patch, given up after a second
/// or two.
/// @throws Error{Errc::notConverged} when the patch cannot be factorized, Error{Errc::cancelled}
RepairOutcome repairFlips(const TriMesh& mesh, std::span<const double> areaShares, int rings,
                          std::vector<Vec3>& directions, const Context& context);

struct FlipsTurned {
  std::string failure;           ///< why flips are left; empty when none are
  std::size_t flips = 0;         ///< before
  std::size_t freeVertices = 0;  ///< how many could move; 0 when there was nothing to do
};

/// repairFlips with wider and wider patches until no flip is left. What `finish` (may be empty) does to the
/// repaired directions must leave none, either. `directions` is only changed on success.
FlipsTurned turnFlipsBack(const TriMesh& mesh, std::span<const double> areaShares,
                          std::vector<Vec3>& directions,
                          const std::function<void(std::vector<Vec3>&)>& finish, Context& context);

/// Moves all vertices from a map without flips down to the minimum of the MIPS energy of the flat triangles
/// between the images, through maps without flips alone: what is left to do where the harmonic map flips more
/// than can be turned back. Ends where the energy no longer falls by much and the area-weighted mean of the
/// directions is 0, or after a few seconds.
/// @throws Error{Errc::notConverged} when a preconditioner cannot be factorized, Error{Errc::cancelled}
void descendFlipFree(const TriMesh& mesh, std::span<const double> areaShares, std::vector<Vec3>& directions,
                     const Context& context);

}  // namespace polestar::detail
