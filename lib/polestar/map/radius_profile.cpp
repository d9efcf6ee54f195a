#include "polestar/map/radius_profile.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"

namespace polestar {
namespace {

/// Slopes at the ends of a cubic of at most this many times its secant keep it rising, by half the secant at
/// least. [Fritsch, Carlson 1980: 3 keep it from falling]
constexpr double kSteepest = 2;
/// The least slope at the surface, as a share of the last secant: the map must not flatten there.
constexpr double kFlattest = 0.25;

bool rises(std::span<const RadiusProfile::Knot> knots) {
  double lastR = 0, lastS = 0;
  for (const auto& [r, s] : knots) {
    if (!(r > lastR && s > lastS)) return false;
    lastR = r, lastS = s;
  }
  return lastR == 1 && lastS == 1;
}

double secant(const RadiusProfile::Knot& a, const RadiusProfile::Knot& b) {
  return (b[1] - a[1]) / (b[0] - a[0]);
}

}  // namespace

const char* toString(RadiusKind kind) {
  switch (kind) {
    case RadiusKind::volume:
      return "volume";
    case RadiusKind::mixed:
      return "mixed";
    case RadiusKind::balanced:
      return "balanced";
    default:
      return "green";
  }
}

RadiusProfile::RadiusProfile(RadiusKind kind, std::vector<Knot> knots)
    : kind_(kind), knots_(std::move(knots)) {
  if (knots_.size() < 2 || !rises(knots_)) {
    throw Error(Errc::usage, "RadiusProfile: knots must rise strictly from above (0, 0) to (1, 1)");
  }
  const std::size_t n = knots_.size();
  // s_1 / R_1 <= kSteepest (s_2 - s_1) / (R_2 - R_1), solved for s_1.
  const double r1 = knots_[0][0], r2 = knots_[1][0];
  knots_[0][1] = std::min(knots_[0][1], kSteepest * knots_[1][1] * r1 / (r2 - r1 + kSteepest * r1));

  slopes_.resize(n);
  slopes_[0] = knots_[0][1] / r1;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    // The mean of the secants by the parabola through three knots.
    const double before = secant(knots_[i - 1], knots_[i]), after = secant(knots_[i], knots_[i + 1]);
    const double left = knots_[i][0] - knots_[i - 1][0], right = knots_[i + 1][0] - knots_[i][0];
    slopes_[i] =
        std::min((right * before + left * after) / (left + right), kSteepest * std::min(before, after));
  }
  const double last = secant(knots_[n - 2], knots_[n - 1]);
  slopes_[n - 1] = std::clamp(2 * last - slopes_[n - 2], kFlattest * last, kSteepest * last);
}

// Number of the knot at the upper end; 0 for the straight piece at the center.
std::size_t RadiusProfile::segmentOf(double ballRadius) const {
  const auto upper = std::lower_bound(knots_.begin(), knots_.end(), ballRadius,
                                      [](const Knot& knot, double r) { return knot[0] < r; });
  return std::min<std::size_t>(upper - knots_.begin(), knots_.size() - 1);
}

double RadiusProfile::value(double ballRadius) const {
  if (knots_.empty()) return ballRadius;
  const std::size_t k = segmentOf(ballRadius);
  if (k == 0) return slopes_[0] * ballRadius;
  const Knot &a = knots_[k - 1], &b = knots_[k];
  const double width = b[0] - a[0], t = (ballRadius - a[0]) / width, u = 1 - t;
  return a[1] * u * u * (1 + 2 * t) + b[1] * t * t * (1 + 2 * u) +
         width * t * u * (u * slopes_[k - 1] - t * slopes_[k]);
}

double RadiusProfile::derivative(double ballRadius) const {
  if (knots_.empty()) return 1;
  const std::size_t k = segmentOf(ballRadius);
  if (k == 0) return slopes_[0];
  const Knot &a = knots_[k - 1], &b = knots_[k];
  const double t = (ballRadius - a[0]) / (b[0] - a[0]), u = 1 - t;
  return 6 * t * u * secant(a, b) + u * (u - 2 * t) * slopes_[k - 1] + t * (t - 2 * u) * slopes_[k];
}

double RadiusProfile::inverse(double s) const {
  if (knots_.empty()) return s;
  double low = 0, high = 1;
  double r = std::clamp(s, 0.0, 1.0);
  // Newton's method, held within a bracket that it narrows.
  for (int i = 0; i < 100 && high - low > 1e-15; ++i) {
    const double miss = value(r) - s;
    (miss > 0 ? high : low) = r;
    const double next = r - miss / derivative(r);
    if (std::abs(next - r) < 1e-15) break;
    r = next > low && next < high ? next : 0.5 * (low + high);
  }
  return r;
}

std::vector<double> volumesWithin(const Foliation& foliation) {
  const std::size_t layers = foliation.layerCount() + 1;  // the cone is one of them
  using Volumes = std::vector<double>;
  Volumes within = detail::reduceChunks(
      foliation.cellCount(), 1 << 14, Volumes(layers, 0.0),
      [&](std::size_t begin, std::size_t end) {
        Volumes part(layers, 0.0);
        for (std::size_t id = begin; id < end; ++id) {
          const auto node = foliation.cell(id);
          const Vec3& origin = foliation.nodes[node[0]];
          const Vec3 a = foliation.nodes[node[1]] - origin, b = foliation.nodes[node[2]] - origin,
                     c = foliation.nodes[node[3]] - origin;
          const double volume = a.dot(b.cross(c)) / 6;
          if (std::isfinite(volume)) part[foliation.layerOf(id)] += volume;
        }
        return part;
      },
      [](Volumes a, const Volumes& b) {
        for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i];
        return a;
      });
  for (std::size_t i = layers - 1; i-- > 0;) within[i] += within[i + 1];
  return within;
}

RadiusProfile radiusProfile(RadiusKind kind, const Foliation& foliation) {
  if (kind == RadiusKind::green) return {};
  if (kind == RadiusKind::balanced) {
    throw Error(Errc::usage, "radiusProfile: the balanced profile comes with its sphere map");
  }
  const std::vector<double> within = volumesWithin(foliation);
  std::vector<RadiusProfile::Knot> knots;
  for (std::size_t level = foliation.levels.size(); level-- > 0;) {
    const double r = foliation.levels[level];
    const double volume = level == 0 ? 1 : std::cbrt(within[level] / within[0]);
    const double s = kind == RadiusKind::volume ? volume : 0.5 * (r + volume);
    // A layer without volume, of inverted cells, has nothing to say.
    if (s > (knots.empty() ? 0 : knots.back()[1]) && (level == 0 || s < 1)) knots.push_back({r, s});
  }
  // Nothing but noise: as near to R as a profile of this kind comes.
  if (knots.size() < 2) knots = {{foliation.levels.back(), foliation.levels.back()}, {1, 1}};
  return {kind, std::move(knots)};
}

}  // namespace polestar
