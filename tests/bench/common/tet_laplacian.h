#pragma once
// The cotangent Laplacian on tetrahedra, linear finite elements, as an opponent: a harmonic function with
// given values on the surface.

#include <functional>
#include <span>
#include <vector>

#include "tet_mesh.h"

namespace polestar::bench {

struct TetSolution {
  std::vector<double> h;  ///< at the vertices
  int iterations = 0;
};

/// Conjugate gradients scaled by the diagonal, on all cores, to `residual` relative to the right-hand side.
/// (Incomplete Cholesky factors take a third of the iterations and, by Eigen, more time.)
/// @throws std::runtime_error when they do not converge.
TetSolution solveTetLaplacian(const TetMesh& mesh, const std::function<double(const Vec3&)>& boundaryValue,
                              double residual = 1e-6);
/// The same with the values of the vertices on the surface.
TetSolution solveTetLaplacian(const TetMesh& mesh, std::span<const double> boundaryValues, double residual);

/// Piecewise linear between the vertices; a point outside of all tetrahedra gets the linear function of the
/// nearest one around.
void interpolateOnTets(const TetMesh& mesh, std::span<const double> h, std::span<const Vec3> points,
                       std::span<double> values);

}  // namespace polestar::bench
