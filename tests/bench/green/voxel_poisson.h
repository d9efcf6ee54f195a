#pragma once
// OpenVDB's own Poisson solver (openvdb/tools/PoissonSolver.h) as an opponent: a harmonic function with given
// values on the surface, on the voxels whose centers lie inside.

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::bench {

/// Laplace h = 0 inside, h = boundaryValue on the surface. Thread-safe functions.
struct DirichletProblem {
  Box box;
  std::function<bool(const Vec3&)> inside;
  std::function<double(const Vec3&)> boundaryValue;  ///< defined near the surface, on both sides
};

/// Where a stencil that leaves the solid finds its boundary value.
enum class VoxelBoundary {
  neighbours,  ///< at the center of the voxel outside: first order
  crossings    ///< where the stencil's arm crosses the surface: second order and symmetric [Gibou 2002]
};

struct VoxelPoissonOptions {
  int dim = 64;  ///< voxels along the longest side of the box
  VoxelBoundary boundary = VoxelBoundary::crossings;
  /// At which the conjugate gradients stop: largest entry of sum (h_neighbour - h), in units of h.
  double residual = 1e-8;
};

class VoxelPoisson {
 public:
  /// Finds the voxels inside.
  VoxelPoisson(DirichletProblem problem, const VoxelPoissonOptions& options);
  ~VoxelPoisson();
  VoxelPoisson(const VoxelPoisson&) = delete;
  VoxelPoisson& operator=(const VoxelPoisson&) = delete;

  /// OpenVDB's conjugate gradients with incomplete Cholesky factors; returns the iterations.
  /// @throws std::runtime_error when they do not converge.
  int solve();

  std::size_t voxels() const;
  std::size_t boundaryVoxels() const;  ///< of the former, those with a neighbour outside

  /// The solution between voxels: the harmonic polynomial of degree 3 that fits best, weighted by distance,
  /// the voxels around and the boundary data that the equations used. Its error is of fourth order, so that
  /// what is seen is the solver's.
  void evaluate(std::span<const Vec3> points, std::span<double> h) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace polestar::bench
