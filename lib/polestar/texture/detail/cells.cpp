#include "polestar/texture/detail/cells.h"

#include <array>

#include "polestar/texture/detail/four_lanes.h"

namespace polestar::detail {
namespace {

/// The two nearest points of a row of cubes along z, each lane its own.
struct Nearest {
  Float4 first = Float4{} + 1e9f, second = Float4{} + 1e9f;  ///< squared distances
  Uint4 firstHash{}, secondHash{};
  Int4 firstRow{}, secondRow{};

  void add(Float4 squared, Uint4 hash, std::int32_t row) {
    const Int4 best = squared < first, better = squared < second, rows = Int4{} + row;
    second = best ? first : (better ? squared : second);
    secondHash = best ? firstHash : (better ? hash : secondHash);
    secondRow = best ? firstRow : (better ? rows : secondRow);
    first = best ? squared : first;
    firstHash = best ? hash : firstHash;
    firstRow = best ? rows : firstRow;
  }
};

struct Candidate {
  float squared = 1e9f;
  std::uint32_t hash = 0;
  std::int32_t row = 0, lane = 0;
};

void keep(const Candidate& candidate, Candidate& first, Candidate& second) {
  if (candidate.squared < first.squared) {
    second = first;
    first = candidate;
  } else if (candidate.squared < second.squared) {
    second = candidate;
  }
}

/// The two nearest of all.
void reduce(const Nearest& nearest, Candidate& first, Candidate& second) {
  // The last lane repeats the one before.
  for (int i = 0; i < 3; ++i) {
    keep({nearest.first[i], nearest.firstHash[i], nearest.firstRow[i], i}, first, second);
    keep({nearest.second[i], nearest.secondHash[i], nearest.secondRow[i], i}, first, second);
  }
}

}  // namespace

Cell cellAt(const VaryingPoint& domain, double jitter, std::uint32_t seed) {
  const Vec3 p = domain.value();
  const std::array<std::int32_t, 3> base = {floorOf(p[0]), floorOf(p[1]), floorOf(p[2])};
  const std::array<float, 3> local = {static_cast<float>(p[0] - base[0]), static_cast<float>(p[1] - base[1]),
                                      static_cast<float>(p[2] - base[2])};
  // Lanes are the cubes one below, at and above along z.
  constexpr Int4 lane = {-1, 0, 1, 1};
  const auto scale = static_cast<float>(jitter / 1023), start = static_cast<float>(0.5 - jitter / 2);
  Nearest nearest;
  for (std::int32_t row = 0; row < 9; ++row) {
    const std::int32_t a = row / 3 - 1, b = row % 3 - 1;
    const Uint4 hash = latticeHash(Int4{} + (base[0] + a), Int4{} + (base[1] + b), lane + base[2], seed);
    const Float4 x = (static_cast<float>(a) + start - local[0]) + scale * tenBits(hash, 0),
                 y = (static_cast<float>(b) + start - local[1]) + scale * tenBits(hash, 10),
                 z = toFloat(lane) + (start - local[2]) + scale * tenBits(hash, 20);
    nearest.add(x * x + y * y + z * z, hash, row);
  }
  Candidate first, second;
  reduce(nearest, first, second);

  /// From the point that is asked for to a cell's own.
  auto offset = [&](const Candidate& c) {
    auto along = [&](int axis, int step) {
      return step + start - local[axis] + scale * static_cast<float>((c.hash >> (10 * axis)) & 1023u);
    };
    return Vec3(along(0, c.row / 3 - 1), along(1, c.row % 3 - 1), along(2, c.lane - 1));
  };
  const Vec3 toFirst = offset(first), toSecond = offset(second);
  const Vec3 between = toSecond - toFirst;
  const double length = std::max(between.norm(), kTiny), distance = std::sqrt(first.squared);
  Cell cell;
  cell.hash = scramble(first.hash);
  cell.neighbour = scramble(second.hash);
  cell.wall = domain.pull((second.squared - first.squared) / (2 * length), -between / length);
  cell.center = domain.pull(distance, -toFirst / std::max(distance, kTiny));
  return cell;
}

}  // namespace polestar::detail
