#pragma once
// Is the sampled map one to one? Applications interpolate `rest` trilinearly between the voxels that were
// written; a cell of eight voxels is good when that interpolant has a positive Jacobian determinant
// everywhere in it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar {

/// Samples on a lattice, size^3, z fastest.
struct VoxelBlock {
  int size = 0;
  std::span<const Vec3f> rest;
  std::span<const float> signedDistance;  ///< mesh units, negative inside
  std::span<const std::uint8_t> active;   ///< 1 where `rest` holds a value
  double voxelSize = 0;                   ///< mesh units
};

struct CellQuality {
  std::size_t voxels = 0;  ///< inside the solid
  std::size_t cells = 0;   ///< with all eight corners inside
  /// Not shown to be positive everywhere: negative somewhere, or undecided.
  std::size_t inverted = 0;
  std::size_t undecided = 0;  ///< of these: neither shown nor refuted after four subdivisions a side
  /// Zero at a corner and negative at none: crowded below float's resolution.
  std::size_t collapsed = 0;
  /// Those with every corner deeper than one voxel below the surface.
  std::size_t invertedDeep = 0, collapsedDeep = 0;
  double minJacobian = 1e300;  ///< smallest determinant at a cell's corner, 1 / mesh unit^3

  CellQuality& operator+=(const CellQuality& other);
};

/// Judges the cells whose lowest corner is one of the first (size - 1)^3 samples; counts voxels among those
/// too.
///
/// The determinant is a polynomial of degree 2 in each variable; 27 positive Bernstein coefficients prove a
/// cell, a corner that is not positive disproves it, subdivision decides in between. Proof and disproof hold
/// for the trilinear interpolant of the stored floats: coefficients count as positive or negative only beyond
/// a bound of their rounding errors, and at a cell's corners exact arithmetic has the last word.
CellQuality judgeCells(const VoxelBlock& block);

/// Lowest corners, by their place in the block, of the cells that judgeCells() counts as invertedDeep.
std::vector<std::array<int, 3>> deepInvertedCells(const VoxelBlock& block);

/// What was done to some samples of a block, so that fewer of its cells are inverted.
struct MendedBlock {
  std::vector<Vec3f> rest;         ///< of the block, in its order
  std::vector<std::size_t> moved;  ///< samples that changed, ascending
  double largestMove = 0;          ///< in the units of `rest`
};
/// `rest`: what the samples are now.
MendedBlock mendedBlock(const VoxelBlock& before, std::vector<Vec3f> rest);

}  // namespace polestar
