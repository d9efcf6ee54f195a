#pragma once
// Solid textures, carried into a solid: voxel by voxel the target asks the texture, by the route of
// texture_route.h, averaged over what the voxel covers there. [Xia 2010, sec. 5, fig. 7]

#include <memory>
#include <string>
#include <vector>

#include "polestar/texture/solid_texture.h"
#include "polestar/texture/texture_route.h"
#include "polestar/vdb/sampled_grids.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {

/// Which names colors get: Houdini and most others read `Cd`, Blender's Principled Volume `color`.
enum class ColorNames { houdini, blender, both };
std::vector<std::string> gridsOfColor(ColorNames names);

/// Fibers that are drawn along the grid `fiber`, as thick all over the target; see line_integral.h.
struct DrawnFibers {
  double strength = 0;       ///< share by which colors get darker and lighter, in [0, 1]; 0: none are drawn
  double thickness = 0.006;  ///< shares of the box's diagonal, as the next
  double length = 0.06;

  void validate() const;  ///< @throws Error{Errc::usage}
};

struct TransferOptions {
  GridOptions grids;  ///< of the target; without effect where `mapped` is given
  /// What `map` wrote of the target, to be filled instead of new grids: `surface` and `density` are its own,
  /// and its ball coordinates are read of `rest`.
  std::shared_ptr<const SolidGrids> mapped;
  DrawnFibers fibers;
  ColorNames colorNames = ColorNames::houdini;
  bool halfColors = false;  ///< colors are saved as half floats
  bool rest = false;        ///< the target's ball coordinates too, after no motion
};

/// What was made, and how.
struct TransferReport {
  struct Grid {
    std::string name;  ///< in the target
    std::string from;  ///< in the source; empty for procedural textures
    std::string how;   ///< "filtered", "as vectors by the inverse Jacobian" ...
    std::string note;  ///< what to know about it; empty where there is nothing
  };
  std::vector<Grid> grids;
  std::size_t voxels = 0;        ///< filled, padding included
  std::size_t unanswered = 0;    ///< of these: where the maps had no answer, left without a value
  std::size_t interpolated = 0;  ///< of the blocks of 4^3 voxels: where the map was interpolated
  std::size_t blocks = 0;        ///< none where nothing but `rest` had to be read
};

struct Transfer {
  SolidGrids grids;
  TransferReport report;
};

/// A texture of the ball: `Cd`, and `fiber` (unit vectors, contravariant) where it has a grain. The solid's
/// `surface` and `density` come along.
/// @throws what SolidGrids throws; Error{Errc::usage} for a route that has a source, and when fibers are to
/// be drawn in what has no grain.
Transfer transferTexture(const TextureRoute& route, const SolidTexture& texture,
                         const TransferOptions& options, Context& context = Context::quiet());

/// A grid of the source, and what it becomes.
struct CarriedGrid {
  std::vector<SampledGrid> sources;  ///< one, or three scalars that make a vector
  std::string name;                  ///< in the target
  bool color = false;                ///< gets ColorNames instead of `name`
};

/// Which grids of a file `transfer` carries: those named, or by default all but the solid's own `surface`,
/// `density`, `rest` and `green`. Colors are `Cd` or `color`, or three scalars named r g b, red green blue,
/// Cd.x Cd.y Cd.z, Cd_x ... or color_r ... in any case of letters.
/// @throws Error{Errc::usage} for a name that is not there; Error{Errc::io} when nothing is left, or a value
/// is not finite (where the first one is).
std::vector<CarriedGrid> chooseGrids(const SampledGrids& file, const std::vector<std::string>& names = {});

/// Grids of the source's world. Scalars and colors are averages over what a voxel of the target covers;
/// contravariant vectors are carried by the inverse of the route's Jacobian, covariant ones by its transpose,
/// positions by the way back. Where no voxel of the source is active within reach, the target's is not
/// either.
/// Fibers are drawn along contravariant vectors named `fiber`.
/// @throws what SolidGrids throws; Error{Errc::usage} for a route without source, or when grids of the source
/// lie nowhere in the source's solid.
Transfer transferGrids(const TextureRoute& route, const std::vector<CarriedGrid>& grids,
                       const TransferOptions& options, Context& context = Context::quiet());

}  // namespace polestar
