#pragma once
// Quasi-Newton descent with a limited memory, L-BFGS [Nocedal 1980; Liu, Nocedal 1989]: the memory, for
// descents with a geometry of their own, and the whole descent in a vector space. Ours depend on their
// preconditioners; Ceres' GradientProblemSolver takes none.

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace polestar::detail {

/// What the memory does with vectors; for Eigen's of any shape.
struct EigenSpace {
  template <class Vector>
  static double dot(const Vector& a, const Vector& b) {
    return a.cwiseProduct(b).sum();
  }
  template <class Vector>
  static void add(Vector& to, double factor, const Vector& b) {
    to += factor * b;
  }
};

/// The last steps and what they did to the gradient, as an approximate inverse Hessian.
template <class Vector, class Space = EigenSpace>
class LimitedMemory {
 public:
  explicit LimitedMemory(std::size_t limit) : limit_(limit) {}

  bool empty() const { return pairs_.empty(); }
  void clear() { pairs_.clear(); }

  /// The oldest pair is forgotten beyond the limit. A step along which the slope did not rise says nothing of
  /// a minimum and is left out.
  void remember(Vector step, Vector change) {
    const double curvature = Space::dot(step, change);
    if (!(curvature > 0)) return;
    pairs_.push_back({std::move(step), std::move(change), 1 / curvature});
    if (pairs_.size() > limit_) pairs_.pop_front();
  }

  /// The inverse Hessian times `gradient`; `precondition(vector)` is what it was before the first pair:
  /// linear, symmetric, positive definite.
  template <class Precondition>
  Vector applyTo(const Vector& gradient, Precondition&& precondition) const {
    Vector q = gradient;
    std::vector<double> alpha(pairs_.size());
    for (std::size_t k = pairs_.size(); k-- > 0;) {
      alpha[k] = pairs_[k].rho * Space::dot(pairs_[k].step, q);
      Space::add(q, -alpha[k], pairs_[k].change);
    }
    Vector result = precondition(q);
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      const double beta = pairs_[k].rho * Space::dot(pairs_[k].change, result);
      Space::add(result, alpha[k] - beta, pairs_[k].step);
    }
    return result;
  }

  /// <step, change> / <change, change> of the oldest pair: the inverse curvature that it saw; nothing when
  /// empty.
  std::optional<double> oldestScale() const {
    if (pairs_.empty()) return std::nullopt;
    const Pair& pair = pairs_.front();
    return 1 / (pair.rho * Space::dot(pair.change, pair.change));
  }

  /// For points on a manifold: `carry(step)` brings the steps along to where the points are now.
  template <class Carry>
  void carrySteps(Carry&& carry) {
    for (Pair& pair : pairs_) carry(pair.step);
  }

 private:
  struct Pair {
    Vector step, change;
    double rho;
  };
  std::size_t limit_;
  std::deque<Pair> pairs_;
};

struct LbfgsOptions {
  int steps = 100;
  std::size_t memory = 8;
  double gain = 1e-5;         ///< of the value, relative, in a step that others may follow
  double longest = HUGE_VAL;  ///< largest entry of a step that is tried
};

/// Moves `x` downhill by preconditioned L-BFGS with backtracking [Armijo 1966]. `evaluate(x, gradient)` is
/// the value, infinite where x is not allowed, and fills the gradient where it is finite;
/// `precondition(vector, memory)` approximates the inverse Hessian. A direction that does not lead downhill
/// clears the memory, and without one ends the descent.
/// @return the value where it ends
template <class Vector, class Evaluate, class Precondition>
double descendLbfgs(Vector& x, const LbfgsOptions& options, Evaluate&& evaluate,
                    Precondition&& precondition) {
  constexpr double kArmijo = 1e-4;
  constexpr int kHalvings = 30;
  LimitedMemory<Vector> memory(options.memory);
  Vector gradient(x), trialGradient(x), trial(x);
  double value = evaluate(x, gradient);
  for (int step = 0; step < options.steps; ++step) {
    const Vector direction =
        -memory.applyTo(gradient, [&](const Vector& q) { return precondition(q, memory); });
    const double slope = EigenSpace::dot(direction, gradient);
    double length = std::min(1.0, options.longest / direction.cwiseAbs().maxCoeff()), next = HUGE_VAL;
    bool accepted = false;
    for (int halving = 0; slope < 0 && halving < kHalvings && !accepted; ++halving) {
      if (halving > 0) length *= 0.5;
      trial = x + length * direction;
      next = evaluate(trial, trialGradient);
      accepted = next <= value + kArmijo * length * slope;
    }
    if (!accepted) {
      if (memory.empty()) break;
      memory.clear();
      continue;
    }
    memory.remember(trial - x, trialGradient - gradient);
    const bool settled = value - next < options.gain * std::abs(next);
    x.swap(trial);
    gradient.swap(trialGradient);
    value = next;
    if (settled) break;
  }
  return value;
}

}  // namespace polestar::detail
