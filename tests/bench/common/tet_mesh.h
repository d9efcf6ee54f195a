#pragma once
// Tetrahedra that fill a solid.

#include <array>
#include <cstdint>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::bench {

struct TetMesh {
  std::vector<Vec3> vertices;  ///< those on the surface first
  std::size_t surfaceVertices = 0;
  std::vector<std::array<std::int32_t, 4>> tetrahedra;  ///< of either orientation
};

}  // namespace polestar::bench
