#pragma once
// A frame as grids: its surface voxelized, and what the ball says of every voxel, read off the complex.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "polestar/morph/morph_path.h"
#include "polestar/texture/solid_texture.h"
#include "polestar/texture/transfer.h"
#include "polestar/vdb/sampled_grids.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {

/// What one shape is made of: a texture of its ball, or colors in the world of a body whose map says where
/// the ball's points lie there.
struct MorphTexture {
  std::shared_ptr<const SolidTexture> solid;
  std::optional<SampledGrid> colors;  ///< where there is no `solid`
  std::vector<Vec3> places;           ///< of the complex's nodes among the colors: MorphComplex::nodesIn
};

struct MorphGridOptions {
  GridOptions grids;
  bool velocity = true;  ///< `vel`
  bool half = false;     ///< velocities and colors are saved as half floats
  ColorNames colorNames = ColorNames::houdini;
};

/// `surface`, `density`, `rest`: the point of the common ball; `vel`: dx/dt where that stays (contravariant,
/// mesh units a second); and with textures, one a shape or none, their colors, blended by the weights, in
/// linear light. |rest| is linear in each tetrahedron, as its direction is up to its length. In the padding
/// all of them go on along the rays from the center: rest = direction |x - c| / |q - c|, colors are those of
/// the surface. Metadata: domain, center, weights. Some 0.3 us a voxel and 0.1 us a cell.
/// @throws what SolidGrids throws
SolidGrids morphGrids(const MorphComplex& complex, const MorphFrame& frame,
                      std::span<const MorphTexture> textures, const MorphGridOptions& options,
                      Context& context = Context::quiet());

}  // namespace polestar
