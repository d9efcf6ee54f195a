#include "field_checks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace polestar::verify {
namespace {

constexpr std::size_t kPlaces = 200000;

/// Solves A x = b, A symmetric positive, by elimination; false when A is singular.
bool solve4(std::array<std::array<double, 5>, 4>& rows, std::array<double, 4>& x) {
  for (std::size_t i = 0; i < 4; ++i) {
    std::size_t pivot = i;
    for (std::size_t r = i + 1; r < 4; ++r) {
      if (std::abs(rows[r][i]) > std::abs(rows[pivot][i])) pivot = r;
    }
    std::swap(rows[i], rows[pivot]);
    if (!(std::abs(rows[i][i]) > 1e-12)) return false;
    for (std::size_t r = 0; r < 4; ++r) {
      if (r == i) continue;
      const double factor = rows[r][i] / rows[i][i];
      for (std::size_t c = i; c < 5; ++c) rows[r][c] -= factor * rows[i][c];
    }
  }
  for (std::size_t i = 0; i < 4; ++i) x[i] = rows[i][4] / rows[i][i];
  return true;
}

/// h = G - 1/r
double regularPart(const VoxelSolid& solid, std::size_t v) {
  return solid.green[v] - 1 / length(solid.position(v) - solid.center);
}

/// Calls visit(voxel) for the inside voxels nearer to the center than `reach`.
template <class Visit>
void visitAround(const VoxelSolid& solid, double reach, Visit&& visit) {
  int first[3], last[3];
  for (int k = 0; k < 3; ++k) {
    const double most = solid.size[static_cast<std::size_t>(k)] - 1;
    first[k] = static_cast<int>(std::clamp(std::floor(solid.center[k] - reach), 0.0, most));
    last[k] = static_cast<int>(std::clamp(std::ceil(solid.center[k] + reach), 0.0, most));
  }
  for (int i = first[0]; i <= last[0]; ++i) {
    for (int j = first[1]; j <= last[1]; ++j) {
      for (int k = first[2]; k <= last[2]; ++k) {
        const std::int32_t v = solid.slot[solid.boxIndex(i, j, k)];
        if (v < 0) continue;
        const auto voxel = static_cast<std::size_t>(v);
        if (length(solid.position(voxel) - solid.center) < reach) visit(voxel);
      }
    }
  }
}

/// h at the center; `fitted` is 0 when too few voxels are around it.
double harmonicAtCenter(const VoxelSolid& solid, std::size_t& fitted) {
  for (const double reach : {4.0, 6.0, 9.0}) {
    std::array<std::array<double, 5>, 4> rows{};
    fitted = 0;
    visitAround(solid, reach, [&](std::size_t v) {
      const Vec3 d = solid.position(v) - solid.center;
      if (solid.isCapped(v) || length(d) < 1.5) return;
      const double basis[4] = {1, d.x, d.y, d.z}, h = regularPart(solid, v);
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = 0; j < 4; ++j) rows[i][j] += basis[i] * basis[j];
        rows[i][4] += basis[i] * h;
      }
      ++fitted;
    });
    std::array<double, 4> x{};
    if (fitted >= 30 && solve4(rows, x)) return x[0];
  }
  fitted = 0;
  return 0;
}

Vec3 restAt(const VoxelSolid& solid, std::size_t voxel) { return toDouble(solid.rest[voxel]); }

/// Places to look at, evenly over the solid.
std::vector<std::size_t> places(const std::vector<std::uint16_t>& depth, std::uint16_t least) {
  std::size_t count = 0;
  for (const std::uint16_t d : depth) count += d >= least;
  const std::size_t stride = std::max<std::size_t>(1, count / kPlaces);
  std::vector<std::size_t> result;
  std::size_t seen = 0;
  for (std::size_t v = 0; v < depth.size(); ++v) {
    if (depth[v] >= least && seen++ % stride == 0) result.push_back(v);
  }
  return result;
}

/// measure(voxel) at all places, in parallel; without those for which it returned a negative number.
template <class Measure>
std::vector<double> measureAt(const std::vector<std::size_t>& where, Measure&& measure) {
  std::vector<double> values(where.size());
  tbb::parallel_for(std::size_t{0}, where.size(), [&](std::size_t i) { values[i] = measure(where[i]); });
  std::erase_if(values, [](double x) { return x < 0; });
  return values;
}

double degrees(double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi; }

}  // namespace

PoleFit fitPole(const VoxelSolid& solid) {
  PoleFit fit;
  std::array<std::size_t, 3> low{};
  Vec3 share;
  for (int k = 0; k < 3; ++k) {
    const double floor = std::floor(solid.center[k]);
    if (!(floor >= 0 && floor + 1 < solid.size[static_cast<std::size_t>(k)])) return fit;
    low[static_cast<std::size_t>(k)] = static_cast<std::size_t>(floor);
    share[k] = solid.center[k] - floor;
  }
  Vec3 rest;
  double slope = 0;
  for (std::size_t q = 0; q < 8; ++q) {
    const std::size_t bit[3] = {q >> 2, q >> 1 & 1, q & 1};
    const std::int32_t v =
        solid.slot[solid.boxIndex(static_cast<int>(low[0] + bit[0]), static_cast<int>(low[1] + bit[1]),
                                  static_cast<int>(low[2] + bit[2]))];
    if (v < 0) return fit;
    const auto voxel = static_cast<std::size_t>(v);
    double weight = 1;
    for (int k = 0; k < 3; ++k) weight *= bit[k] ? share[k] : 1 - share[k];
    rest = rest + weight * restAt(solid, voxel);
  }
  // The mean slope over the voxels around is the map's there, wherever exactly rest vanishes.
  std::size_t count = 0;
  visitAround(solid, 2.5, [&](std::size_t v) {
    for (const std::int64_t stride : solid.strides()) {
      const std::int32_t next = solid.neighbour(v, stride);
      if (next < 0) continue;
      slope += length(restAt(solid, static_cast<std::size_t>(next)) - restAt(solid, v));
      ++count;
    }
  });
  fit.inside = true;
  fit.restOffset = length(rest) / (slope / static_cast<double>(count));
  const double h = harmonicAtCenter(solid, fit.fitted);
  fit.ratio = -1 / (h * solid.harmonicRadius);
  return fit;
}

BoundaryFit fitBoundary(const VoxelSolid& solid) {
  std::vector<double> ends;
  for (std::size_t v = 0; v < solid.count(); ++v) {
    const double d = -solid.surface[v];
    if (d > 1) continue;
    // The neighbour that lies deepest.
    std::size_t best = v;
    for (const std::int64_t stride : solid.strides()) {
      for (const std::int64_t step : {-stride, stride}) {
        const std::int32_t other = solid.neighbour(v, step);
        if (other >= 0 && solid.surface[static_cast<std::size_t>(other)] < solid.surface[best]) {
          best = static_cast<std::size_t>(other);
        }
      }
    }
    const double gained = -solid.surface[best] - d;
    if (!(gained > 0.5)) continue;
    const double here = length(restAt(solid, v)), below = length(restAt(solid, best));
    ends.push_back(here + (here - below) * d / gained);
  }
  BoundaryFit fit;
  fit.lines = ends.size();
  fit.low = quantile(ends, 0.1);
  fit.median = quantile(ends, 0.5);
  fit.high = quantile(ends, 0.9);
  return fit;
}

RadiusFit fitRadius(const VoxelSolid& solid) {
  RadiusFit fit;
  const auto note = [&](double off, std::size_t v) {
    ++fit.voxels;
    if (!(off <= fit.worst)) fit.worst = off, fit.at = v;
  };
  if (solid.radiusIsOfGreen) {
    for (std::size_t v = 0; v < solid.count(); ++v) {
      const double off = length(restAt(solid, v)) - solid.radiusOfGreen(v);
      note(solid.isCapped(v) ? std::max(off, 0.0) : std::abs(off), v);
    }
    return fit;
  }
  std::vector<std::uint32_t> order(solid.count());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return solid.green[a] > solid.green[b]; });
  double most = 0;
  for (const std::uint32_t v : order) {
    if (solid.isCapped(v)) continue;
    const double radius = length(restAt(solid, v));
    note(most - radius, v);
    most = std::max(most, radius);
  }
  return fit;
}

HarmonicFit fitHarmonic(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth) {
  const auto strides = solid.strides();
  const auto off = [&](std::size_t v) -> double {
    const std::int64_t step = std::max(1, (depth[v] - 1) / 3);
    const double here = regularPart(solid, v);
    if (solid.isCapped(v)) return -1;
    double sum = 0;
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) {
        for (int k = -1; k <= 1; ++k) {
          // 14 for the middles of the cube's sides, 3 of its edges, 1 for its corners; 128 in all.
          static constexpr int kWeights[4] = {0, 14, 3, 1};
          const int weight = kWeights[std::abs(i) + std::abs(j) + std::abs(k)];
          if (weight == 0) continue;
          const std::int32_t other =
              solid.neighbour(v, step * (i * strides[0] + j * strides[1] + k * strides[2]));
          const auto voxel = static_cast<std::size_t>(other);
          if (other < 0 || solid.isCapped(voxel)) return -1;
          sum += weight * regularPart(solid, voxel);
        }
      }
    }
    return solid.harmonicRadius * std::abs(sum / 128 - here);
  };
  std::vector<double> values = measureAt(places(depth, 4), off);
  return {values.size(), quantile(values, 0.5), quantile(values, 0.98)};
}

LineFit fitLines(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth) {
  constexpr double kCoreMargin = 1.1, kPoleDistance = 4;
  const auto strides = solid.strides();
  std::vector<std::size_t> where = places(depth, 4);
  std::erase_if(where, [&](std::size_t v) {
    return solid.radiusOfGreen(v) < kCoreMargin * solid.coreRadius ||
           length(solid.position(v) - solid.center) < kPoleDistance;
  });
  const auto gradientOfGreen = [&](std::size_t v) {
    // The pole's part is differentiated as it is, only h by differences.
    const Vec3 d = solid.position(v) - solid.center;
    const double r = length(d);
    Vec3 gradient = (-1 / (r * r * r)) * d;
    for (int k = 0; k < 3; ++k) {
      const auto high = static_cast<std::size_t>(solid.neighbour(v, strides[static_cast<std::size_t>(k)]));
      const auto low = static_cast<std::size_t>(solid.neighbour(v, -strides[static_cast<std::size_t>(k)]));
      gradient[k] += 0.5 * (regularPart(solid, high) - regularPart(solid, low));
    }
    return gradient;
  };
  const auto angle = [&](std::size_t v) -> double {
    // grad (p . rest) and grad (q . rest) for directions p, q across rest: both are at right angles to the
    // curve along which rest only gets longer.
    const Vec3 rest = restAt(solid, v);
    const Vec3 other = std::abs(rest.x) < 0.6 * length(rest) ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 p = cross(rest, other), q = cross(rest, p);
    Vec3 gradP, gradQ;
    for (int k = 0; k < 3; ++k) {
      const auto high = static_cast<std::size_t>(solid.neighbour(v, strides[static_cast<std::size_t>(k)]));
      const auto low = static_cast<std::size_t>(solid.neighbour(v, -strides[static_cast<std::size_t>(k)]));
      const Vec3 slope = restAt(solid, high) - restAt(solid, low);
      gradP[k] = dot(p, slope);
      gradQ[k] = dot(q, slope);
    }
    const Vec3 tangent = cross(gradP, gradQ), gradient = gradientOfGreen(v);
    const double lengths = length(tangent) * length(gradient);
    return lengths > 0 ? degrees(std::abs(dot(tangent, gradient)) / lengths) : -1;
  };
  const auto straight = [&](std::size_t v) -> double {
    const Vec3 d = solid.position(v) - solid.center, gradient = gradientOfGreen(v);
    return degrees(std::abs(dot(d, gradient)) / (length(d) * length(gradient)));
  };
  struct Place {
    double angle, straight;
  };
  std::vector<Place> found(where.size());
  tbb::parallel_for(std::size_t{0}, where.size(),
                    [&](std::size_t i) { found[i] = {angle(where[i]), straight(where[i])}; });
  std::erase_if(found, [](const Place& p) { return p.angle < 0; });
  const auto medianOf = [](const auto& begin, const auto& end, double Place::*member) {
    std::vector<double> values;
    for (auto p = begin; p != end; ++p) values.push_back((*p).*member);
    return quantile(values, 0.5);
  };
  LineFit fit;
  fit.places = found.size();
  fit.median = medianOf(found.begin(), found.end(), &Place::angle);
  fit.straight = medianOf(found.begin(), found.end(), &Place::straight);
  const auto bent = found.begin() + static_cast<std::ptrdiff_t>(found.size() - found.size() / 10);
  std::nth_element(found.begin(), bent, found.end(),
                   [](const Place& p, const Place& q) { return p.straight < q.straight; });
  fit.bentMedian = medianOf(bent, found.end(), &Place::angle);
  fit.bentStraight = medianOf(bent, found.end(), &Place::straight);
  return fit;
}

}  // namespace polestar::verify
