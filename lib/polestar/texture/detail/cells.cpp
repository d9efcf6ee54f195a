#include "polestar/texture/detail/cells.h"

#include <array>
#include <limits>

#include "polestar/texture/detail/noise.h"

namespace polestar::detail {
namespace {

struct Candidate {
  double squared = std::numeric_limits<double>::infinity();
  std::uint32_t hash = 0;
  Vec3 offset = Vec3::Zero();  ///< from the point that is asked for
};

/// Squared distance of a coordinate, in its unit interval, from the interval `step` further.
double gap(double x, int step) {
  const double distance = step == 0 ? 0 : step > 0 ? 1 - x : x;
  return distance * distance;
}

}  // namespace

Cell cellAt(const VaryingPoint& domain, double jitter, std::uint32_t seed) {
  const Vec3 p = domain.value();
  const Vec3 floor(std::floor(p[0]), std::floor(p[1]), std::floor(p[2]));
  const Vec3 local = p - floor;
  const auto i = static_cast<std::int32_t>(floor[0]), j = static_cast<std::int32_t>(floor[1]),
             k = static_cast<std::int32_t>(floor[2]);
  Candidate first, second;
  // The own cube first, then outwards: most of the others are then too far to matter.
  constexpr std::array<int, 3> steps = {0, -1, 1};
  for (const int a : steps) {
    const double gapX = gap(local[0], a);
    if (gapX >= second.squared) continue;
    for (const int b : steps) {
      const double gapXY = gapX + gap(local[1], b);
      if (gapXY >= second.squared) continue;
      for (const int c : steps) {
        if (gapXY + gap(local[2], c) >= second.squared) continue;
        const std::uint32_t hash = latticeHash(i + a, j + b, k + c, seed);
        auto at = [&](int shift) { return 0.5 + jitter * (((hash >> shift) & 1023) / 1023.0 - 0.5); };
        const Vec3 offset = Vec3(a + at(0), b + at(10), c + at(20)) - local;
        const double squared = offset.squaredNorm();
        if (squared < first.squared) {
          second = first;
          first = {squared, hash, offset};
        } else if (squared < second.squared) {
          second = {squared, hash, offset};
        }
      }
    }
  }
  const Vec3 between = second.offset - first.offset;
  const double length = std::max(between.norm(), kTiny), distance = std::sqrt(first.squared);
  Cell cell;
  cell.hash = scramble(first.hash);
  cell.neighbour = scramble(second.hash);
  cell.wall = domain.pull((second.squared - first.squared) / (2 * length), -between / length);
  cell.center = domain.pull(distance, -first.offset / std::max(distance, kTiny));
  return cell;
}

}  // namespace polestar::detail
