#include "polestar/sphere/detail/sphere_descent.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "polestar/core/detail/lbfgs.h"
#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

using Field = std::vector<Vec3>;  // one tangent vector a point

constexpr std::size_t kChunk = 4096;
constexpr std::size_t kHistory = 8;
constexpr double kArmijo = 1e-4;
/// Relative change of the energy that is rounding and no news.
constexpr double kEnergyNoise = 1e-13;
/// A displacement (radians) at which long needles let rounding stop the descent; beyond it a stop is a
/// failure.
constexpr double kRoundingFloor = 1e-6;

double dot(const Field& a, const Field& b) {
  return reduceChunks(
      a.size(), kChunk, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += a[i].dot(b[i]);
        return sum;
      },
      [](double x, double y) { return x + y; });
}

double largest(const Field& a) {
  return std::sqrt(reduceChunks(
      a.size(), kChunk, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t i = begin; i < end; ++i) most = std::max(most, a[i].squaredNorm());
        return most;
      },
      [](double x, double y) { return std::max(x, y); }));
}

template <class Body>
void forEach(std::size_t count, Body&& body) {
  parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

void makeTangent(Field& field, const Field& points) {
  forEach(field.size(), [&](std::size_t i) { field[i] -= points[i] * points[i].dot(field[i]); });
}

/// Tangent vectors, all at the current points: steps are carried along by projection.
struct FieldSpace {
  static double dot(const Field& a, const Field& b) { return detail::dot(a, b); }
  static void add(Field& to, double factor, const Field& b) {
    forEach(to.size(), [&](std::size_t i) { to[i] += factor * b[i]; });
  }
};
using Memory = LimitedMemory<Field, FieldSpace>;

Field quasiNewtonDirection(const SphereEnergy& energy, const Memory& memory, const Field& points,
                           const Field& gradient) {
  Field direction = memory.applyTo(gradient, [&](const Field& q) {
    Field result(q.size());
    energy.precondition(q, result);
    makeTangent(result, points);
    return result;
  });
  makeTangent(direction, points);
  forEach(direction.size(), [&](std::size_t i) { direction[i] = -direction[i]; });
  return direction;
}

}  // namespace

DescentResult descendOnSpheres(const SphereEnergy& energy, std::vector<Vec3>& points,
                               const DescentOptions& options, const Context& context) {
  const std::size_t n = points.size();
  DescentResult result;
  Field gradient(n), trial(n), trialGradient(n);
  Memory memory(kHistory);
  bool stalled = false;

  result.energy = energy.evaluate(points, gradient);
  makeTangent(gradient, points);
  for (; result.iterations < options.maxIterations; ++result.iterations) {
    context.throwIfCancelled();
    Field direction = quasiNewtonDirection(energy, memory, points, gradient);
    double slope = dot(gradient, direction);
    if (!(slope < 0)) {
      if (memory.empty()) break;
      memory.clear();
      direction = quasiNewtonDirection(energy, memory, points, gradient);
      slope = dot(gradient, direction);
      if (!(slope < 0)) break;
    }
    result.remaining = largest(direction);
    if (result.remaining < options.tolerance) {
      result.converged = true;
      break;
    }

    // Backtracking; a full step is the rule. No step turns a point by more than a radian or so.
    double step = std::min(1.0, 1.0 / result.remaining);
    bool accepted = false;
    double value = 0;
    for (int tries = 0; tries < 40 && !accepted; ++tries, step *= accepted ? 1 : 0.5) {
      forEach(n, [&](std::size_t i) { trial[i] = (points[i] + step * direction[i]).normalized(); });
      value = energy.evaluate(trial, trialGradient);
      ++result.evaluations;
      if (!std::isfinite(value)) continue;
      makeTangent(trialGradient, trial);
      const double noise = kEnergyNoise * std::abs(result.energy);
      accepted = value <= result.energy + kArmijo * step * slope - noise ||
                 (value <= result.energy + noise && std::abs(dot(trialGradient, direction)) <= -0.9 * slope);
    }
    if (!accepted) {
      stalled = memory.empty();
      if (stalled) break;
      memory.clear();
      continue;
    }

    memory.carrySteps([&](Field& earlier) { makeTangent(earlier, trial); });
    Field moved(n), changed(n);
    forEach(n, [&](std::size_t i) {
      const Vec3& s = trial[i];
      const Vec3 m = trial[i] - points[i], c = trialGradient[i] - gradient[i];
      moved[i] = m - s * s.dot(m);
      changed[i] = c - s * s.dot(c);
    });
    memory.remember(std::move(moved), std::move(changed));
    points.swap(trial);
    gradient.swap(trialGradient);
    result.energy = value;
  }
  // The line search failed from a fresh start: rounding is all that is left, or the tolerance is beyond it.
  result.converged = result.converged || (stalled && result.remaining < kRoundingFloor);
  return result;
}

}  // namespace polestar::detail
