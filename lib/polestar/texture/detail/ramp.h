#pragma once
// Colors along a line, and their mean over an interval of it.

#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "polestar/core/types.h"
#include "polestar/texture/detail/footprint.h"

namespace polestar::detail {

/// Linear between stops in linear light, constant beyond them.
class Ramp {
 public:
  struct Stop {
    double at;
    Vec3f color;
  };
  /// In ascending order, at least one.
  explicit Ramp(std::vector<Stop> stops);
  /// Colors as people write them: 0xrrggbb, sRGB.
  Ramp(std::initializer_list<std::pair<double, std::uint32_t>> stops);

  /// Mean over the interval of `width` around `middle`: exact.
  Vec3f mean(double middle, double width) const;
  Vec3f mean(const Varying& x, const Footprint& footprint) const { return mean(x.value, footprint.width(x)); }

 private:
  Vec3f at(double x, std::size_t segment) const;
  Vec3 integralTo(double x) const;
  std::size_t segmentOf(double x) const;

  std::vector<Stop> stops_;
  std::vector<Vec3> integral_;  ///< from the first stop to each
};

}  // namespace polestar::detail
