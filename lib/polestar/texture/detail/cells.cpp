#include "polestar/texture/detail/cells.h"

#include <array>
#include <utility>

#include "polestar/texture/detail/four_lanes.h"

namespace polestar::detail {
namespace {

/// The three nearest points of the rows so far, each lane its own.
struct Nearest {
  struct Points {
    Float4 squared = Float4{} + 1e9f;
    Uint4 hash{};
    Int4 row{};
  };
  std::array<Points, 3> best;  ///< nearest first

  POLESTAR_INTO_CLONES void add(Points points) {
    for (Points& other : best) {
      const Int4 nearer = points.squared < other.squared;
      exchange(nearer, points.squared, other.squared);
      exchange(nearer, points.hash, other.hash);
      exchange(nearer, points.row, other.row);
    }
  }

 private:
  template <class Lanes4>
  POLESTAR_INTO_CLONES static void exchange(Int4 where, Lanes4& a, Lanes4& b) {
    const Lanes4 kept = where ? a : b;
    a = where ? b : a;
    b = kept;
  }
};

struct Candidate {
  float squared = 1e9f;
  std::uint32_t hash = 0;
  std::int32_t row = 0, lane = 0;
};

/// The three nearest of all lanes.
POLESTAR_INTO_CLONES std::array<Candidate, 3> reduce(const Nearest& nearest) {
  std::array<Candidate, 3> best;
  for (const Nearest::Points& points : nearest.best) {
    // The last lane repeats the one before.
    for (int i = 0; i < 3; ++i) {
      Candidate candidate{points.squared[i], points.hash[i], points.row[i], i};
      for (Candidate& other : best) {
        if (candidate.squared < other.squared) std::swap(candidate, other);
      }
    }
  }
  return best;
}

}  // namespace

POLESTAR_SIMD_CLONES Cell cellAt(const VaryingPoint& domain, double jitter, std::uint32_t seed) {
  const Vec3 p = domain.value();
  const std::array<std::int32_t, 3> base = {floorOf(p[0]), floorOf(p[1]), floorOf(p[2])};
  const std::array<float, 3> local = {static_cast<float>(p[0] - base[0]), static_cast<float>(p[1] - base[1]),
                                      static_cast<float>(p[2] - base[2])};
  // Lanes are the cubes one below, at and above along z.
  constexpr Int4 kLane = {-1, 0, 1, 1};
  const auto scale = static_cast<float>(jitter / 1023), start = static_cast<float>(0.5 - jitter / 2);
  Nearest nearest;
  for (std::int32_t row = 0; row < 9; ++row) {
    const std::int32_t a = row / 3 - 1, b = row % 3 - 1;
    const Uint4 hash = latticeHash(Int4{} + (base[0] + a), Int4{} + (base[1] + b), kLane + base[2], seed);
    const Float4 x = (static_cast<float>(a) + start - local[0]) + scale * tenBits(hash, 0),
                 y = (static_cast<float>(b) + start - local[1]) + scale * tenBits(hash, 10),
                 z = toFloat(kLane) + (start - local[2]) + scale * tenBits(hash, 20);
    nearest.add({x * x + y * y + z * z, hash, Int4{} + row});
  }
  const std::array<Candidate, 3> best = reduce(nearest);

  // From the point that is asked for to a cell's own.
  auto offset = [&](const Candidate& c) {
    auto along = [&](int axis, int step) {
      return step + start - local[axis] + scale * static_cast<float>((c.hash >> (10 * axis)) & 1023u);
    };
    return Vec3(along(0, c.row / 3 - 1), along(1, c.row % 3 - 1), along(2, c.lane - 1));
  };
  const Vec3 own = offset(best[0]);
  const double distance = std::sqrt(best[0].squared);
  Cell cell;
  cell.center = domain.pull(distance, -own / std::max(distance, kTiny));
  for (int i = 0; i < 3; ++i) cell.hash[i] = scramble(best[i].hash);
  for (int i = 0; i < 2; ++i) {
    const Vec3 between = offset(best[i + 1]) - own;
    const double length = std::max(between.norm(), kTiny);
    cell.walls[i] = domain.pull((best[i + 1].squared - best[0].squared) / (2 * length), -between / length);
  }
  return cell;
}

std::array<double, 3> Cell::shares(double softness, const Footprint& footprint) const {
  // Two cells share a footprint as the plane between them cuts it; three do in the proportions that each has
  // to the first.
  std::array<double, 3> shares{1, 0, 0};
  double sum = 1;
  for (int i = 0; i < 2; ++i) {
    const double first = shareAbove(walls[i], softness, footprint);
    shares[i + 1] = (1 - first) / std::max(first, 0.5);
    sum += shares[i + 1];
  }
  for (double& share : shares) share /= sum;
  return shares;
}

}  // namespace polestar::detail
