#include "polestar/render/detail/fog_march.h"

#include <algorithm>
#include <cmath>

namespace polestar::detail {
namespace {

constexpr double kDeepest = 6.9;  // optical depth: a thousandth gets through

}  // namespace

bool FogMarch::isGone(const Vec3& point) const {
  return std::any_of(medium_.gone.begin(), medium_.gone.end(), [&](const std::vector<Plane>& region) {
    return std::all_of(region.begin(), region.end(), [&](const Plane& p) { return p.height(point) <= 0; });
  });
}

/// Calls visit(begin, end, optical depth of the step) until that says false.
template <class Visit>
void FogMarch::march(const Vec3& origin, const Vec3& direction, double jitter, double step,
                     const Visit& visit) {
  probe_.spans(origin, direction, spans_);
  for (const FogSpan& span : spans_) {
    const double begin = std::max(0.0, span.begin), length = span.end - begin;
    if (!(length > 0)) continue;
    const double count = std::ceil(length / step), dt = length / count;
    for (double i = 0; i < count; ++i) {
      const Vec3 point = origin + (begin + (i + jitter) * dt) * direction;
      if (!medium_.gone.empty() && isGone(point)) continue;
      const auto density = static_cast<double>(probe_.density(point));
      if (density <= 0) continue;
      if (!visit(begin + i * dt, begin + (i + 1) * dt, medium_.extinction * density * dt)) return;
    }
  }
}

double FogMarch::transmittance(const Vec3& origin, const Vec3& direction, double jitter, double stretch) {
  double depth = 0;
  march(origin, direction, jitter, stretch * medium_.step, [&](double, double, double added) {
    depth += added;
    return depth < kDeepest;
  });
  return depth < kDeepest ? std::exp(-depth) : 0;
}

double FogMarch::follow(const Vec3& origin, const Vec3& direction, double jitter) {
  way_.clear();
  double depth = 0;
  march(origin, direction, jitter, medium_.step, [&](double begin, double end, double added) {
    depth += added;
    way_.push_back({begin, end, depth});
    return depth < kDeepest;
  });
  return depth < kDeepest ? std::exp(-depth) : 0;
}

double FogMarch::scatterDistance(double share) const {
  // Light is scattered before the depth d with probability 1 - exp(-d).
  const double total = way_.back().depth;
  const double depth = std::min(total, -std::log1p(-share * -std::expm1(-total)));
  const auto step =
      std::lower_bound(way_.begin(), way_.end(), depth, [](const Step& s, double d) { return s.depth < d; });
  const double before = step == way_.begin() ? 0 : std::prev(step)->depth;
  const double part = step->depth > before ? (depth - before) / (step->depth - before) : 0;
  return step->begin + part * (step->end - step->begin);
}

}  // namespace polestar::detail
