#pragma once
// Turns over what a conformal map of a coarse or needle-ridden mesh left upside down, near the place and
// nowhere else.

#include <cstddef>
#include <span>
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

}  // namespace polestar::detail
