#pragma once
// One row, measured.

#include "row.h"

namespace polestar::bench {

/// Runs the row in this process. Keys: those of the row, then `status` ("ok" or "not installed"), `surface`
/// (vertices on the surface, or voxels with a neighbour outside), `unknowns`, `setup` and `solve` {wall, cpu}
/// in seconds, `peak_bytes`, `iterations`; with a `reference` `error_max`, `error_rms` of rho (G - G_exact);
/// for our solvers `boundary_error` (the solver's own samples), `boundary_check` (other samples), `passes`,
/// `stop`; for the layer `charge`, `unresolved_area`, `layer_vertices`.
/// @throws std::exception when the method fails.
Json runRow(const Row& row, const Reference* reference);

}  // namespace polestar::bench
