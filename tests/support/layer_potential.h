#pragma once
// The potential of a single layer by another closed form than the library's: the oracle of its near field and
// bounds.

#include <span>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

/// Integral of density(y)/|x - y| over the mesh, the density linear on its triangles, anywhere in space: edge
/// by edge over all triangles, no fast method and no quadrature. [Wilton et al. 1984]
double layerPotential(const TriMesh& mesh, std::span<const double> density, const Vec3& x);

}  // namespace polestar::testing
