#include "field_checks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace polestar::verify {
namespace {

constexpr std::size_t kPlaces = 200000;

/// Least squares of values by N functions: normal equations, added up one place at a time.
template <std::size_t N>
class LinearFit {
 public:
  void add(const std::array<double, N>& basis, double value) {
    for (std::size_t i = 0; i < N; ++i) {
      for (std::size_t j = 0; j < N; ++j) rows_[i][j] += basis[i] * basis[j];
      rows_[i][N] += basis[i] * value;
    }
    ++count_;
  }
  std::size_t count() const { return count_; }
  /// NaN where the places do not determine them.
  std::array<double, N> coefficients() {
    std::array<double, N> x{};
    for (std::size_t i = 0; i < N; ++i) {  // Gauss and Jordan
      std::size_t pivot = i;
      for (std::size_t r = i + 1; r < N; ++r) {
        if (std::abs(rows_[r][i]) > std::abs(rows_[pivot][i])) pivot = r;
      }
      std::swap(rows_[i], rows_[pivot]);
      for (std::size_t r = 0; r < N; ++r) {
        const double factor = r == i ? 0 : rows_[r][i] / rows_[i][i];
        for (std::size_t c = i; c <= N; ++c) rows_[r][c] -= factor * rows_[i][c];
      }
    }
    for (std::size_t i = 0; i < N; ++i) x[i] = rows_[i][N] / rows_[i][i];
    return x;
  }

 private:
  std::array<std::array<double, N + 1>, N> rows_{};
  std::size_t count_ = 0;
};

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

Vec3 restAt(const VoxelSolid& solid, std::size_t voxel) { return toDouble(solid.rest[voxel]); }

/// Voxels to look at, evenly over the solid: with three others between them and the outside, or with fewer
/// where the grid is so coarse that hardly any were left.
std::vector<std::size_t> places(const std::vector<std::uint16_t>& depth) {
  constexpr std::size_t kFew = 1000;
  const auto deeper = [&](int least) {
    return static_cast<std::size_t>(
        std::count_if(depth.begin(), depth.end(), [&](std::uint16_t d) { return d >= least; }));
  };
  int least = 4;
  while (least > 2 && deeper(least) < kFew) --least;
  const std::size_t stride = std::max<std::size_t>(1, deeper(least) / kPlaces);
  std::vector<std::size_t> result;
  std::size_t seen = 0;
  for (std::size_t v = 0; v < depth.size(); ++v) {
    if (depth[v] >= least && seen++ % stride == 0) result.push_back(v);
  }
  return result;
}

/// measure(voxel) at all places, in parallel; without those for which it returned no number from 0 on.
template <class Measure>
std::vector<double> measureAt(const std::vector<std::size_t>& where, Measure&& measure) {
  std::vector<double> values(where.size());
  tbb::parallel_for(std::size_t{0}, where.size(), [&](std::size_t i) { values[i] = measure(where[i]); });
  std::erase_if(values, [](double x) { return !(x >= 0); });
  return values;
}

/// f at the next voxel along an axis less f at the one before, both inside.
template <class Function>
auto centralDifference(const VoxelSolid& solid, std::size_t v, int axis, Function&& f) {
  const std::int64_t stride = solid.strides()[static_cast<std::size_t>(axis)];
  return f(static_cast<std::size_t>(solid.neighbour(v, stride))) -
         f(static_cast<std::size_t>(solid.neighbour(v, -stride)));
}

/// The pole's part is differentiated as it is, only h by differences.
Vec3 gradientOfGreen(const VoxelSolid& solid, std::size_t v) {
  const Vec3 d = solid.position(v) - solid.center;
  const double r = length(d);
  Vec3 gradient = (-1 / (r * r * r)) * d;
  for (int k = 0; k < 3; ++k) {
    gradient[k] +=
        0.5 * centralDifference(solid, v, k, [&](std::size_t other) { return regularPart(solid, other); });
  }
  return gradient;
}

/// Direction of the curve along which rest only gets longer: at right angles to grad (p . rest) and
/// grad (q . rest), p and q across rest.
Vec3 isoCurve(const VoxelSolid& solid, std::size_t v) {
  const Vec3 rest = restAt(solid, v);
  const Vec3 other = std::abs(rest.x) < 0.6 * length(rest) ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 p = cross(rest, other), q = cross(rest, p);
  Vec3 gradP, gradQ;
  for (int k = 0; k < 3; ++k) {
    const Vec3 slope =
        centralDifference(solid, v, k, [&](std::size_t neighbour) { return restAt(solid, neighbour); });
    gradP[k] = dot(p, slope);
    gradQ[k] = dot(q, slope);
  }
  return cross(gradP, gradQ);
}

/// Of two lines, in degrees; 90 where one of them has no direction.
double angleBetween(const Vec3& a, const Vec3& b) {
  const double lengths = length(a) * length(b);
  if (!(lengths > 0)) return 90;
  return std::acos(std::min(1.0, std::abs(dot(a, b)) / lengths)) * 180 / std::numbers::pi;
}

}  // namespace

PoleFit fitPole(const VoxelSolid& solid) {
  PoleFit fit;
  visitAround(solid, 1, [&](std::size_t) { fit.inside = true; });
  // |rest| = s |x - p| up to the third order: its square is a paraboloid over p.
  LinearFit<5> paraboloid;
  visitAround(solid, 2.5, [&](std::size_t v) {
    const Vec3 d = solid.position(v) - solid.center, rest = restAt(solid, v);
    paraboloid.add({1, d.x, d.y, d.z, dot(d, d)}, dot(rest, rest));
  });
  const auto p = paraboloid.coefficients();
  fit.restOffset = length((-0.5 / p[4]) * Vec3{p[1], p[2], p[3]});
  for (const double reach : {4.0, 6.0, 9.0}) {
    LinearFit<4> line;
    visitAround(solid, reach, [&](std::size_t v) {
      const Vec3 d = solid.position(v) - solid.center;
      if (!solid.isCapped(v) && length(d) > 1.5) line.add({1, d.x, d.y, d.z}, regularPart(solid, v));
    });
    if (line.count() < 30) continue;
    fit.ratio = -1 / (line.coefficients()[0] * solid.harmonicRadius);
    break;
  }
  return fit;
}

BoundaryFit fitBoundary(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth) {
  BoundaryFit fit;
  std::vector<double> ends;
  for (std::size_t v = 0; v < solid.count(); ++v) {
    if (depth[v] != 1) continue;
    const double d = -solid.surface[v];
    ++fit.rim;
    fit.tooDeep += d > std::sqrt(3.0) + 0.01;
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
    const double here = solid.domain.gauge(restAt(solid, v)), below = solid.domain.gauge(restAt(solid, best));
    ends.push_back(here + (here - below) * d / gained);
  }
  fit.median = quantile(ends, 0.5);
  fit.low = quantile(ends, 0.01);
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
    const std::int64_t step = std::max(1, (depth[v] - 1) / 2);
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
  std::vector<double> values = measureAt(places(depth), off);
  return {values.size(), quantile(values, 0.5), quantile(values, 0.98)};
}

LineFit fitLines(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth) {
  constexpr double kCoreMargin = 1.1, kPoleDistance = 4;
  std::vector<std::size_t> where = places(depth);
  std::erase_if(where, [&](std::size_t v) {
    return solid.radiusOfGreen(v) < kCoreMargin * solid.coreRadius ||
           length(solid.position(v) - solid.center) < kPoleDistance;
  });
  struct Place {
    double angle, straight;
  };
  std::vector<Place> found(where.size());
  tbb::parallel_for(std::size_t{0}, where.size(), [&](std::size_t i) {
    const Vec3 gradient = gradientOfGreen(solid, where[i]);
    found[i] = {angleBetween(isoCurve(solid, where[i]), gradient),
                angleBetween(solid.position(where[i]) - solid.center, gradient)};
  });
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
