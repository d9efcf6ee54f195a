#include "polestar/texture/detail/cells.h"

#include <array>

#include "polestar/texture/detail/four_lanes.h"

namespace polestar::detail {
namespace {

/// The two nearest points of a column of lattice cubes, each lane its own column's.
struct Nearest {
  Float4 first = Float4{} + 1e9f, second = Float4{} + 1e9f;  ///< squared distances
  Uint4 firstHash{}, secondHash{};
  std::array<Float4, 3> firstOffset{}, secondOffset{};

  void add(Float4 squared, Uint4 hash, const std::array<Float4, 3>& offset) {
    const Int4 best = squared < first, better = squared < second;
    second = best ? first : (better ? squared : second);
    secondHash = best ? firstHash : (better ? hash : secondHash);
    for (int axis = 0; axis < 3; ++axis) {
      secondOffset[axis] = best ? firstOffset[axis] : (better ? offset[axis] : secondOffset[axis]);
      firstOffset[axis] = best ? offset[axis] : firstOffset[axis];
    }
    first = best ? squared : first;
    firstHash = best ? hash : firstHash;
  }
};

struct Candidate {
  float squared = 1e9f;
  std::uint32_t hash = 0;
  Vec3 offset = Vec3::Zero();  ///< from the point that is asked for
};

void keep(const Candidate& candidate, Candidate& first, Candidate& second) {
  if (candidate.squared < first.squared) {
    second = first;
    first = candidate;
  } else if (candidate.squared < second.squared) {
    second = candidate;
  }
}

}  // namespace

Cell cellAt(const VaryingPoint& domain, double jitter, std::uint32_t seed) {
  const Vec3 p = domain.value();
  const Vec3 floor(std::floor(p[0]), std::floor(p[1]), std::floor(p[2]));
  const Eigen::Vector3f local = (p - floor).cast<float>();
  const Eigen::Vector3i base = floor.cast<int>();
  // Lanes are the cubes one below, at and above along z; the last repeats and is ignored.
  constexpr Int4 lane = {-1, 0, 1, 1};
  const auto scale = static_cast<float>(jitter / 1023), start = static_cast<float>(0.5 - jitter / 2);
  Nearest nearest;
  for (int a = -1; a <= 1; ++a) {
    for (int b = -1; b <= 1; ++b) {
      const Uint4 hash = latticeHash(Int4{} + (base[0] + a), Int4{} + (base[1] + b), lane + base[2], seed);
      const std::array<Float4, 3> offset = {a + start - local[0] + scale * tenBits(hash, 0),
                                            b + start - local[1] + scale * tenBits(hash, 10),
                                            toFloat(lane) + (start - local[2]) + scale * tenBits(hash, 20)};
      nearest.add(offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2], hash, offset);
    }
  }
  Candidate first, second;
  for (int i = 0; i < 3; ++i) {
    const auto& one = nearest.firstOffset;
    const auto& two = nearest.secondOffset;
    keep({nearest.first[i], nearest.firstHash[i], Vec3(one[0][i], one[1][i], one[2][i])}, first, second);
    keep({nearest.second[i], nearest.secondHash[i], Vec3(two[0][i], two[1][i], two[2][i])}, first, second);
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
