#include <algorithm>
#include <cmath>

#include "polestar/chart/green_chart.h"
#include "polestar/core/detail/parallel.h"

namespace polestar {
namespace {

// Dormand & Prince 1980: stages, fifth-order weights (which are the last stage's), and the error's weights.
constexpr int kStages = 7;
constexpr double kNode[kStages] = {0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1, 1};
constexpr double kWeight[kStages][6] = {{},
                                        {1. / 5},
                                        {3. / 40, 9. / 40},
                                        {44. / 45, -56. / 15, 32. / 9},
                                        {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
                                        {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
                                        {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}};
constexpr double kError[kStages] = {71. / 57600,      0,         -71. / 16695, 71. / 1920,
                                    -17253. / 339200, 22. / 525, -1. / 40};

constexpr std::size_t kLinesInStep = 16;
constexpr int kMaxSteps = 600;
constexpr double kSmallestStep = 1e-7, kFirstStep = 0.1, kLargestStep = 2;

double ballRadiusOf(double s) { return 1 / (1 + std::exp(s)); }
double logGreenOf(double ballRadius) { return std::log(1 / ballRadius - 1); }

// One line on its way.
struct Traveller {
  double s = 0;              // ln(rho G)
  Vec3 y = Vec3::Zero();     // x / R
  double step = kFirstStep;  // the step that the error control wants
  std::size_t level = 0;     // the next one to reach
  int steps = 0;
  bool active = false;
  double tried = 0;  // the step under way, shortened to end on a level
  std::array<Vec3, kStages> slope{Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero(),
                                  Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  double h = 0, gradientNorm = 0;  // at the current point: h and |grad G|
  Vec3 gradient = Vec3::Zero();    // of h
};

// Lines that share their evaluations, stage by stage.
class Batch {
 public:
  Batch(const GreenFunction& green, double tolerance, std::span<const double> levels)
      : field_(green.field()), harmonicRadius_(green.harmonicRadius()), tolerance_(tolerance) {
    for (const double r : levels) levelS_.push_back(logGreenOf(r));
  }

  void run(std::span<const Vec3> starts, std::span<FieldLineTracer::Line> lines) {
    lines_ = lines;
    begin(starts);
    while (std::any_of(travellers_.begin(), travellers_.end(), [](const Traveller& t) { return t.active; }))
      step();
  }

 private:
  void begin(std::span<const Vec3> starts) {
    travellers_.assign(starts.size(), {});
    std::vector<std::size_t> all(starts.size());
    for (std::size_t i = 0; i < starts.size(); ++i) all[i] = i;
    points_.assign(starts.begin(), starts.end());
    evaluate(all);
    for (std::size_t i = 0; i < starts.size(); ++i) {
      Traveller& t = travellers_[i];
      const double scaledGreen = harmonicRadius_ * (1 / starts[i].norm() + h_[i]);
      if (!(scaledGreen > 0)) continue;
      t.s = std::log(scaledGreen);
      const auto first = std::upper_bound(levelS_.begin(), levelS_.end(), t.s);
      if (first == levelS_.end()) continue;
      t.level = static_cast<std::size_t>(first - levelS_.begin());
      lines_[i].firstLevel = t.level;
      lines_[i].startRadius = ballRadiusOf(t.s);
      t.y = starts[i] / ballRadiusOf(t.s);
      take(t, i, t.s, t.y);
      t.slope[0] = slopeAt(t.s, t.y, starts[i], gradient_[i]);
      t.active = true;
    }
  }

  void step() {
    std::vector<std::size_t> active;
    for (std::size_t i = 0; i < travellers_.size(); ++i) {
      Traveller& t = travellers_[i];
      if (!t.active) continue;
      const double remaining = levelS_[t.level] - t.s;
      // Equal steps up to the level, so that no crumb is left before it.
      t.tried = remaining / std::ceil(remaining / t.step);
      active.push_back(i);
    }
    std::vector<Vec3> y(active.size());
    for (int stage = 1; stage < kStages; ++stage) {
      points_.clear();
      for (std::size_t a = 0; a < active.size(); ++a) {
        const Traveller& t = travellers_[active[a]];
        y[a] = t.y;
        for (int j = 0; j < stage; ++j) y[a] += t.tried * kWeight[stage][j] * t.slope[j];
        points_.push_back(ballRadiusOf(t.s + kNode[stage] * t.tried) * y[a]);
      }
      evaluate(active);
      for (std::size_t a = 0; a < active.size(); ++a) {
        Traveller& t = travellers_[active[a]];
        t.slope[stage] = slopeAt(t.s + kNode[stage] * t.tried, y[a], points_[a], gradient_[a]);
      }
    }
    // The last stage sits at the end of the step: its evaluation serves the next step and the node.
    for (std::size_t a = 0; a < active.size(); ++a) finishStep(active[a], a, y[a]);
  }

  void finishStep(std::size_t line, std::size_t a, const Vec3& y) {
    Traveller& t = travellers_[line];
    Vec3 error = Vec3::Zero();
    for (int j = 0; j < kStages; ++j) error += t.tried * kError[j] * t.slope[j];
    const double s = t.s + t.tried;
    // A flux tube is |grad G|^(-1/2) wide: errors are measured against it.
    const double scaled = ballRadiusOf(s) * error.norm() * std::sqrt(t.gradientNorm) / tolerance_;
    if (!std::isfinite(scaled) || ++t.steps > kMaxSteps) {
      t.step = std::isfinite(scaled) ? t.tried : 0.2 * t.tried;
      if (t.steps > kMaxSteps || t.step < kSmallestStep) t.active = false;
      return;
    }
    const double factor = std::clamp(0.9 * std::pow(std::max(scaled, 1e-12), -0.2), 0.2, 4.0);
    if (scaled > 1) {
      t.step = factor * t.tried;
      if (t.step < kSmallestStep) t.active = false;
      return;
    }
    const bool reachedLevel = s >= levelS_[t.level] - 1e-12;
    // A step that was cut short by a level says little about how long it could have been.
    t.step = std::min(kLargestStep, reachedLevel ? std::max(t.step, factor * t.tried) : factor * t.tried);
    take(t, a, reachedLevel ? levelS_[t.level] : s, y);
    t.slope[0] = t.slope[kStages - 1];
    if (reachedLevel) arrive(line, points_[a]);
  }

  void take(Traveller& t, std::size_t a, double s, const Vec3& y) {
    t.s = s;
    t.y = y;
    t.h = h_[a];
    t.gradient = gradient_[a];
    t.gradientNorm = (gradient_[a] - points_[a] / std::pow(points_[a].norm(), 3)).norm();
  }

  void arrive(std::size_t line, const Vec3& x) {
    Traveller& t = travellers_[line];
    lines_[line].nodes.push_back({x, t.h, t.gradient});
    if (++t.level < levelS_.size()) return;
    t.active = false;
    // Off its level by more than a little, a line was caught somewhere on the way.
    const double scaledGreen = harmonicRadius_ * (1 / x.norm() + t.h);
    lines_[line].ok = std::abs(std::log(scaledGreen) - t.s) < 0.05;
  }

  Vec3 slopeAt(double s, const Vec3& y, const Vec3& x, const Vec3& gradientOfH) const {
    const double r = x.norm(), e = std::exp(s);
    const Vec3 gradient = gradientOfH - x / (r * r * r);
    return e * (1 + e) / harmonicRadius_ * gradient / gradient.squaredNorm() + e / (1 + e) * y;
  }

  void evaluate(const std::vector<std::size_t>& active) {
    h_.resize(points_.size());
    gradient_.resize(points_.size());
    field_.evaluate(points_, h_, gradient_);
    for (const std::size_t i : active) ++lines_[i].evaluations;
  }

  const HarmonicField& field_;
  double harmonicRadius_, tolerance_;
  std::vector<double> levelS_;
  std::span<FieldLineTracer::Line> lines_;
  std::vector<Traveller> travellers_;
  std::vector<Vec3> points_, gradient_;
  std::vector<double> h_;
};

}  // namespace

FieldLineTracer::FieldLineTracer(GreenFunction green, double tolerance)
    : green_(std::move(green)), tolerance_(tolerance) {}

std::vector<FieldLineTracer::Line> FieldLineTracer::trace(std::span<const Vec3> starts,
                                                          std::span<const double> levels) const {
  std::vector<Line> lines(starts.size());
  detail::parallelChunks(starts.size(), kLinesInStep, [&](std::size_t begin, std::size_t end) {
    Batch batch(green_, tolerance_, levels);
    batch.run(starts.subspan(begin, end - begin), std::span(lines).subspan(begin, end - begin));
  });
  return lines;
}

Vec3 limitDirection(const Vec3& outer, double outerRadius, const Vec3& inner, double innerRadius) {
  // y = x / R = y0 + c R^2 + ...
  const double share = innerRadius * innerRadius / (outerRadius * outerRadius);
  return (inner / innerRadius - share * outer / outerRadius).normalized();
}

}  // namespace polestar
