#pragma once
// An enclosure of the signs that leave a layer's Green's function no critical point but the center.

#include <cstddef>
#include <cstdint>
#include <span>

#include "polestar/core/context.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/green/green_function.h"

namespace polestar::detail {

struct SignOptions {
  double delta = 1e-3;           ///< the surface is shrunk by this share towards the center
  bool normal = true;            ///< look at the normal sign, too
  std::size_t points = 1000000;  ///< at which the gradient may be evaluated
};

/// Bounds x . grad G~ and n . grad G~ from above on every face of the shrunk surface, G~ = 1/|x| + the
/// layer's potential itself (not what evaluation makes of it, which is not harmonic).
///
/// Each face is cut into pieces until the gradients at the corners of a piece, what their evaluation may miss
/// and a bound for the variation between them (slope_variation.h) leave no other sign, or the points are
/// spent: first on faces that need few. Exact but for the rounding of gradients, for which a relative 1e-11
/// of the pole's largest is added. Same result for any number of threads.
/// @throws Error{Errc::cancelled}
SignProof encloseSigns(const LayerField& field, const SignOptions& options, Context& context);

/// Whether x . grad G~ can be shown to be negative on these faces alone, by triangles of the layer: a look
/// ahead at other deltas, which proves nothing of the whole.
bool radialSignHolds(const LayerField& field, const SignOptions& options,
                     std::span<const std::uint32_t> triangles, Context& context);

}  // namespace polestar::detail
