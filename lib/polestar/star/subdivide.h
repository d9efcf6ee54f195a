#pragma once
// A table of field lines is as fine as the surface that they start from: large triangles are cut before.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "polestar/star/star_shape.h"

namespace polestar {

/// The same solid with smaller triangles: those that are wider than `largestAngle` (radians, seen from the
/// center) are cut at the middles of edges until none is; the rest as far as it takes to stay conforming. The
/// first vertices are those of `shape`; midpoints are rounded, which moves the surface by an ulp. Returns
/// `shape` itself where nothing is too wide, or where that ulp hides the center (margins near 1e-16).
/// About 4 pi / largestAngle^2 vertices more at most on compact bodies.
StarShape subdivide(const StarShape& shape, double largestAngle, Context& context = Context::quiet());

/// A refinement of a shape.
struct RefinedShape {
  StarShape shape;
  std::vector<std::array<std::int32_t, 2>> parents;  ///< of the vertices that were added
};
/// The same solid with the marked triangles cut once at their longest edges, and neighbours as far as it
/// takes; nothing where the rounding of midpoints hides the center.
std::optional<RefinedShape> bisect(const StarShape& shape, const std::vector<char>& marked);

}  // namespace polestar
