#pragma once
// Tetrahedra that are turned over, put right by moving some of their corners as little as it takes.

#include <array>
#include <cstdint>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/types.h"

namespace polestar::detail {

struct TetPatch {
  struct Tet {
    std::array<std::uint32_t, 4> node;
    /// Edges from the first corner, as columns, of the shape that the tetrahedron should have. One whose
    /// determinant is not positive says nothing: the tetrahedron is counted, and pulls at nothing.
    Mat3 reference;
  };
  std::vector<Vec3> nodes;  ///< those that may move come first
  std::size_t free = 0;     ///< how many may
  std::vector<Tet> tets;
};

/// Places of the free nodes with fewer bad tetrahedra, inverted or flat, than there were; empty when none
/// were found.
///
/// Minimizes the sum over the tetrahedra of |J|^2 / (3 d^(2/3)) + kVolume (d + 1/d) / 2, J from the
/// reference to the present shape, d its determinant: first with d regularized so that it may be negative
/// [Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov 2021, "Foldover-free maps in 50 lines of code"],
/// then as a barrier. By L-BFGS, preconditioned with incomplete factors of the references' Laplacian. Serial;
/// some hundred passes over the patch.
/// @throws Error{Errc::cancelled}
std::vector<Vec3> untangleTets(TetPatch patch, const Context& context);

}  // namespace polestar::detail
