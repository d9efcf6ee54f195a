#include "coverage.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "voxel_cells.h"

namespace polestar::verify {
namespace {

constexpr int kLattice = 64;  // cubes along the longest side of the domain's box

/// One target in each cube of a lattice around the domain, off its center by a fixed pseudo-random offset, so
/// that targets and cells have no common pattern.
class Targets {
 public:
  explicit Targets(const Domain& domain)
      : low_(domain.low()), positions_(kLattice * kLattice * kLattice), held_(positions_.size()) {
    const Vec3 extent = domain.high() - low_;
    cube_ = std::max({extent.x, extent.y, extent.z}) / kLattice;
    std::uint64_t state = 0;
    const auto offset = [&] {  // splitmix64
      std::uint64_t z = state += 0x9E3779B97F4A7C15ULL;
      z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
      z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
      return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
    };
    for (std::size_t t = 0; t < positions_.size(); ++t) {
      const std::size_t cube[3] = {t / (kLattice * kLattice), t / kLattice % kLattice, t % kLattice};
      for (int k = 0; k < 3; ++k) {
        positions_[t][k] = low_[k] + (static_cast<double>(cube[k]) + offset()) * cube_;
      }
      held_[t] = domain.gauge(positions_[t]) < 1;
    }
  }

  std::size_t count() const { return positions_.size(); }
  const Vec3& operator[](std::size_t t) const { return positions_[t]; }
  bool isInDomain(std::size_t t) const { return held_[t] != 0; }

  /// Calls visit(t) for the targets in the box.
  template <class Visit>
  void visitBox(const Vec3& low, const Vec3& high, Visit&& visit) const {
    int first[3], last[3];
    for (int k = 0; k < 3; ++k) {
      first[k] = cubeOf(low[k] - low_[k]);
      last[k] = cubeOf(high[k] - low_[k]);
    }
    for (int i = first[0]; i <= last[0]; ++i) {
      for (int j = first[1]; j <= last[1]; ++j) {
        for (int k = first[2]; k <= last[2]; ++k) {
          const auto t = static_cast<std::size_t>((i * kLattice + j) * kLattice + k);
          const Vec3& y = positions_[t];
          const bool inBox =
              y.x >= low.x && y.x <= high.x && y.y >= low.y && y.y <= high.y && y.z >= low.z && y.z <= high.z;
          if (inBox && isInDomain(t)) visit(t);
        }
      }
    }
  }

 private:
  int cubeOf(double x) const {
    return static_cast<int>(std::clamp(std::floor(x / cube_), 0.0, kLattice - 1.0));
  }

  Vec3 low_;
  double cube_ = 0;
  std::vector<Vec3> positions_;
  std::vector<char> held_;
};

/// +1 or -1 when y is in the tetrahedron, by its orientation; else 0.
int signOver(const Vec3& y, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const double whole = det(b - a, c - a, d - a);
  if (whole == 0) return 0;
  const int sign = whole > 0 ? 1 : -1;
  const Vec3 ya = a - y, yb = b - y, yc = c - y, yd = d - y;
  const bool inside = sign * det(yb, yc, yd) >= 0 && sign * det(ya, yd, yc) >= 0 &&
                      sign * det(ya, yb, yd) >= 0 && sign * det(ya, yc, yb) >= 0;
  return inside ? sign : 0;
}

/// Ways from corner 0 to corner 7 along the cell's sides, with the orientation of the tetrahedron on them.
struct Way {
  std::size_t first, second;
  int sign;
};
constexpr Way kWays[6] = {{4, 6, 1}, {2, 3, 1}, {1, 5, 1}, {4, 5, -1}, {2, 6, -1}, {1, 3, -1}};

}  // namespace

Coverage measureCoverage(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth) {
  const Targets targets(solid.domain);
  std::vector<std::int32_t> net(targets.count(), 0), any(targets.count(), 0), layer(targets.count(), 0);
  const auto add = [](std::int32_t& counter, int value) {
    std::atomic_ref<std::int32_t>(counter).fetch_add(value, std::memory_order_relaxed);
  };
  const auto addCell = [&](std::size_t v) {
    CellCorners rest;
    std::array<std::int32_t, 8> corners{};
    if (!cellCorners(solid, solid.box[v], rest, corners)) return;
    Vec3 low = rest[0], high = rest[0];
    for (const Vec3& p : rest) {
      for (int k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
    targets.visitBox(low, high, [&](std::size_t t) {
      for (const Way& way : kWays) {
        const int sign = signOver(targets[t], rest[0], rest[way.first], rest[way.second], rest[7]);
        if (sign == 0) continue;
        add(net[t], sign * way.sign);
        add(any[t], 1);
      }
    });
  };
  const auto addLayer = [&](std::size_t v) {
    if (depth[v] != 1) return;
    const Vec3 here = toDouble(solid.rest[v]);
    double farthest = 0;
    for (const std::int64_t stride : solid.strides()) {
      for (const std::int64_t step : {-stride, stride}) {
        const std::int32_t other = solid.neighbour(v, step);
        if (other < 0) continue;
        farthest = std::max(farthest, length(toDouble(solid.rest[static_cast<std::size_t>(other)]) - here));
      }
    }
    const double reach = 3 * farthest;
    const Vec3 corner{reach, reach, reach};
    targets.visitBox(here - corner, here + corner, [&](std::size_t t) {
      const Vec3 away = targets[t] - here;
      if (dot(away, away) <= reach * reach) add(layer[t], 1);
    });
  };
  tbb::parallel_for(std::size_t{0}, solid.count(), [&](std::size_t v) {
    addCell(v);
    addLayer(v);
  });

  Coverage coverage;
  for (std::size_t t = 0; t < targets.count(); ++t) {
    if (!targets.isInDomain(t)) continue;
    ++coverage.targets;
    coverage.touched += any[t] > 0;
    if (layer[t] > 0 && any[t] == 0) continue;
    ++coverage.judged;
    if (net[t] == 1) continue;
    ++(net[t] == 0 ? coverage.uncovered : coverage.repeated);
    coverage.example = coverage.example + targets[t];
  }
  const std::size_t bad = coverage.uncovered + coverage.repeated;
  if (bad > 0) coverage.example = (1 / static_cast<double>(bad)) * coverage.example;
  return coverage;
}

}  // namespace polestar::verify
