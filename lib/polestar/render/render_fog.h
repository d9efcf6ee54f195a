#pragma once
// Pictures of fogs: rays march through the density of a .vdb, light is scattered once.

#include <memory>

#include "polestar/render/render_solid.h"
#include "polestar/vdb/fog_volume.h"

namespace polestar {

struct FogOptions {
  /// How far light gets, on average, in fog of density 1: share of half the diagonal of the fog's box, > 0.
  double meanFreePath = 0.04;
  /// Of the light that the fog meets, what it sends on; times the grid's color, where there is one.
  Vec3f albedo = Vec3f::Constant(0.92f);

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// A fog on the stage of SolidRenderer, with its light, floor, cuts (but no exploded pieces) and turns.
///
/// A camera ray marches by steps of a voxel, shifted at random as a whole; one of the places where it may be
/// scattered is chosen by its share, and from there two rays march to the key light and into the dome, by
/// steps of two voxels. What is not scattered sees the floor, shaded by the same kind of rays. So alpha is as
/// exact as the steps are short, and light as smooth as there are samples. Stretches without fog are skipped.
/// The same bytes for any number of threads; crops as SolidRenderer has them. No AOVs.
/// Rendering::solidSamples counts samples that met fog.
class FogRenderer {
 public:
  /// @throws Error{Errc::usage} for impossible options.
  FogRenderer(const FogVolume& fog, const FogOptions& look, const RenderOptions& options);
  ~FogRenderer();

  /// @throws Error{Errc::cancelled}
  Rendering render(double turn = 0, Context& context = Context::quiet()) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

}  // namespace polestar
