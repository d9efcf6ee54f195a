#pragma once
// How the values of a grid transform, in OpenVDB's terms.

namespace polestar {

/// What a map does to the values of a grid.
enum class ValueRole {
  invariant,            ///< carried as they are: scalars, colors, coordinates
  contravariant,        ///< vectors, relative to where they stand: by the Jacobian
  covariant,            ///< gradients: by its inverse transpose
  covariantNormalized,  ///< normals: the same, then of length 1
  position              ///< points of the world: by the map itself
};

}  // namespace polestar
