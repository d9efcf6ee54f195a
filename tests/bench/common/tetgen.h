#pragma once
// TetGen [Si 2015] as a program of its own; nothing of it is linked.

#include <optional>

#include "polestar/mesh/tri_mesh.h"
#include "tet_mesh.h"

namespace polestar::bench {

/// Fills a closed surface with tetrahedra about as large as its triangles, radius to edge at most 1.414, and
/// keeps the surface as it is: its vertices come first and in their order.
/// @return nothing when there is no `tetgen` on the PATH.
/// @throws std::runtime_error when it fails.
std::optional<TetMesh> tetrahedralize(const TriMesh& surface);

}  // namespace polestar::bench
