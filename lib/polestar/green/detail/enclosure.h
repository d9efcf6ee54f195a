#pragma once
// An enclosure of the boundary error of a layer's Green's function, by which "at most" can be said of it.

#include <functional>
#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/green/green_function.h"

namespace polestar::detail {

struct EnclosureOptions {
  double goal = 1e-3;            ///< of rho |G|: where the bound is below, nothing is refined
  double spare = 0.1;            ///< or below the largest value seen, times 1 + spare
  std::size_t points = 2000000;  ///< at which G may be evaluated
};

struct Enclosure {
  double bound = 0;             ///< rho |G~ - G| is at most this everywhere inside and on the surface
  double largest = 0;           ///< of rho |G| in all points that were looked at, without allowances
  Vec3 worst = Vec3::Zero();    ///< where that was
  Vec3 weakest = Vec3::Zero();  ///< middle of the piece of surface with the largest bound
  std::size_t points = 0, pieces = 0;
  double onSurface = 0;  ///< the part of `bound` that the layer itself has on the surface
  double evaluation =
      0;  ///< the part that the field's quadrature and truncated sums add when it is evaluated
  double truncation = 0;  ///< of that, the sums'
  double variation = 0;   ///< on the weakest piece: what lies between its corners
  double quadrature = 0;  ///< there: what is allowed for at the corners
};

/// Bounds rho |G| on the surface, and from it, by the maximum principle, the error inside of the field as it
/// is evaluated.
///
/// Every triangle is cut into pieces until the values at the corners of a piece and a bound for the variation
/// between them (flat_variation.h) stay below the goal or the points are spent. The bound is about exact
/// arithmetic but for the rounding of values, for which a relative 1e-12 of the pole's potential is added.
/// @param mesh and density in the field's axes
Enclosure encloseBoundary(const LayerField& field, double harmonicRadius, const EnclosureOptions& options,
                          Context& context);

}  // namespace polestar::detail
