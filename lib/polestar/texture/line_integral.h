#pragma once
// Fibers drawn along a field of directions by line-integral convolution [Cabral and Leedom 1993]: noise is
// averaged along the field's lines, so it stays alike along them and varies across. It runs in the space of a
// solid, where streaks keep their thickness everywhere; noise in ball coordinates is stretched with the map.

#include <cstdint>
#include <functional>
#include <span>

#include "polestar/core/context.h"
#include "polestar/core/types.h"

namespace polestar {

/// Directions at points, both in the space of the solid, of any length and either sign; 0 or NaN where there
/// is none. Called from many threads with batches of points; spans have one size.
using FiberField = std::function<void(std::span<const Vec3> points, std::span<Vec3> directions)>;

struct LineIntegralOptions {
  double length = 0;  ///< of the line that is averaged over, mesh units, > 0; streaks are about half as long
  double thickness = 0;  ///< of a streak, mesh units, > 0
  double contrast = 1;   ///< > 0; 1 spreads values evenly over [-1, 1], more drives them to its ends
  std::uint32_t seed = 1;

  /// @throws Error{Errc::usage} that names the field at fault.
  void validate() const;
};

/// A value in [-1, 1] for every point, mean 0: the same for the same field and options, whatever else is in
/// the batch. A line ends where the field does; with no direction at the point itself, the value is plain
/// noise. Cost a point: 2 length / thickness steps, each one value of noise and two of the
/// field; in parallel.
void lineIntegral(std::span<const Vec3> points, const FiberField& field, const LineIntegralOptions& options,
                  std::span<float> values, Context& context = Context::quiet());

}  // namespace polestar
