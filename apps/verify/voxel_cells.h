#pragma once
// Cells of eight inside voxels. Programs interpolate `rest` trilinearly in them, so that interpolant has to
// keep orientation: its Jacobian, a polynomial of degree 2 in each variable, has to be positive all over the
// cell.

#include "voxel_solid.h"

namespace polestar::verify {

using CellCorners = std::array<Vec3, 8>;  ///< 4 i + 2 j + k for the corner (i, j, k)

enum class CellVerdict {
  positive,   ///< proved by positive Bernstein coefficients, of the cell or of its parts
  collapsed,  ///< zero at a corner, negative at none: crowded below what floats tell apart
  inverted    ///< negative or zero without such an excuse somewhere, or open after four subdivisions a side
};

struct CellSums {
  std::size_t cells = 0;
  std::size_t deep = 0;  ///< cells with all corners farther than one voxel below the surface
  std::size_t inverted = 0, invertedDeep = 0, collapsed = 0;
  double volume = 0;             ///< integral of the Jacobian over all cells
  std::array<int, 3> deepest{};  ///< an inverted cell, the one farthest below the surface; box indices
  double deepestSurface = 1;     ///< `surface` there, nearest corner
};

struct CellJudgement {
  CellVerdict verdict;
  double volume;  ///< integral of the Jacobian over the cell: the signed volume of its image
};
CellJudgement judgeCell(const CellCorners& rest);

/// Corners of the cell whose lowest corner is box index `at`; false when it is not complete.
bool cellCorners(const VoxelSolid& solid, std::size_t at, CellCorners& rest,
                 std::array<std::int32_t, 8>& voxel);

/// Parallel; 1 us a cell.
CellSums judgeCells(const VoxelSolid& solid);

}  // namespace polestar::verify
