#include "polestar/green/detail/spread_points.h"

#include <algorithm>
#include <limits>

namespace polestar::detail {

std::vector<std::size_t> spreadPoints(std::span<const Vec3> points, std::span<const double> spacing,
                                      std::size_t count) {
  constexpr double kTie = 1 + 1e-6;
  std::vector<double> squared(points.size(), std::numeric_limits<double>::infinity());
  std::size_t next = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (points[i].squaredNorm() > kTie * points[next].squaredNorm()) next = i;
  }
  std::vector<std::size_t> chosen;
  while (chosen.size() < std::min(count, points.size())) {
    chosen.push_back(next);
    const Vec3 last = points[next];
    double farthest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      squared[i] = std::min(squared[i], (points[i] - last).squaredNorm());
      const double gap = squared[i] / (spacing[i] * spacing[i]);
      if (gap > kTie * farthest) {
        farthest = gap;
        next = i;
      }
    }
  }
  return chosen;
}

}  // namespace polestar::detail
