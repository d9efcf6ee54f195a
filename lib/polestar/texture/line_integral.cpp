#include "polestar/texture/line_integral.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/texture/detail/noise.h"

namespace polestar {
namespace {

constexpr std::size_t kChunk = 1024;
/// Steps along a line per thickness: half of one is well below the noise's wavelength.
constexpr double kStepsPerThickness = 2;
/// Noise at places that are more steps apart has nothing in common.
constexpr std::size_t kCorrelatedSteps = 8;

/// Correlation of simplexNoise with itself at this distance: that of wave vectors with the density
/// |k|^2 exp(-|k|^2 / 2 spread^2), the spread fitted to measurements.
double noiseCorrelation(double distance) {
  constexpr double kSpread = 3.1;
  const double t = distance * distance * kSpread * kSpread;
  return (1 - t / 3) * std::exp(-t / 2);
}

/// Weights of the steps 0, 1, ... to one side: a bell that ends at 0, so that streaks have soft ends.
std::vector<double> stepWeights(std::size_t steps) {
  std::vector<double> weights;
  for (std::size_t i = 0; i < steps; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(steps);
    weights.push_back(0.5 + 0.5 * std::cos(std::numbers::pi * t));
  }
  return weights;
}

/// Lines through the points of a batch, all one step further at a time.
class Lines {
 public:
  Lines(std::span<const Vec3> points, const FiberField& field, double step)
      : field_(field),
        step_(step),
        at_(points.begin(), points.end()),
        direction_(points.size(), Vec3::Zero()) {
    directionsAt(at_, direction_);
    start_ = direction_;
  }

  /// Back to the points, looking the other way.
  void restart(std::span<const Vec3> points, double sign) {
    std::copy(points.begin(), points.end(), at_.begin());
    for (std::size_t i = 0; i < start_.size(); ++i) direction_[i] = sign * start_[i];
  }

  const Vec3& point(std::size_t i) const { return at_[i]; }
  bool alive(std::size_t i) const { return !direction_[i].isZero(); }

  /// Midpoint rule; a line that has lost its direction stays where it is, and is no longer alive.
  void advance() {
    std::vector<Vec3> middle(at_.size()), turned(at_.size());
    for (std::size_t i = 0; i < at_.size(); ++i) middle[i] = at_[i] + step_ / 2 * direction_[i];
    directionsAt(middle, turned);
    follow(turned);
    for (std::size_t i = 0; i < at_.size(); ++i) at_[i] += step_ * direction_[i];
    directionsAt(at_, turned);
    follow(turned);
  }

 private:
  void directionsAt(std::span<const Vec3> points, std::span<Vec3> directions) const {
    field_(points, directions);
    for (Vec3& d : directions) {
      const double length = d.norm();
      d = length > 0 && std::isfinite(length) ? Vec3(d / length) : Vec3::Zero();
    }
  }

  /// A field of fibers has no sign: a line keeps its own.
  void follow(std::span<const Vec3> directions) {
    for (std::size_t i = 0; i < at_.size(); ++i) {
      const double sign = directions[i].dot(direction_[i]) < 0 ? -1 : 1;
      direction_[i] = alive(i) ? Vec3(sign * directions[i]) : Vec3::Zero();
    }
  }

  const FiberField& field_;
  double step_;
  std::vector<Vec3> at_, direction_, start_;
};

/// Sum of weighted noise along each point's line.
class Convolution {
 public:
  explicit Convolution(const LineIntegralOptions& options)
      : options_(options),
        weights_(stepWeights(std::max<std::size_t>(
            1, static_cast<std::size_t>(
                   std::ceil(kStepsPerThickness * options.length / options.thickness / 2))))) {
    for (std::size_t i = 0; i < kCorrelatedSteps; ++i) {
      correlation_.push_back(noiseCorrelation(static_cast<double>(i) / (2 * kStepsPerThickness)));
    }
    wholeVariance_ = variance(weights_.size() - 1, weights_.size() - 1);
  }

  void run(std::span<const Vec3> points, const FiberField& field, std::span<float> values) const {
    Lines lines(points, field, options_.thickness / kStepsPerThickness);
    std::vector<double> sums(points.size(), 0.0);
    std::vector<std::size_t> forwards(points.size(), 0), backwards(points.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i) sums[i] = weights_[0] * noiseAt(points[i]);
    addSide(lines, forwards, sums);
    lines.restart(points, -1);
    addSide(lines, backwards, sums);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool whole = std::min(forwards[i], backwards[i]) + 1 == weights_.size();
      const double normal = sums[i] / std::sqrt(whole ? wholeVariance_ : variance(forwards[i], backwards[i]));
      // Of a normal variable, erf(x / sqrt 2) is uniform.
      values[i] = static_cast<float>(std::erf(options_.contrast * normal / std::numbers::sqrt2));
    }
  }

 private:
  /// Waves of the noise are as long as two streaks are thick.
  double noiseAt(const Vec3& point) const {
    return detail::simplexNoise(point / (2 * options_.thickness), options_.seed).value;
  }

  void addSide(Lines& lines, std::vector<std::size_t>& steps, std::vector<double>& sums) const {
    for (std::size_t step = 1; step < weights_.size(); ++step) {
      lines.advance();
      for (std::size_t i = 0; i < sums.size(); ++i) {
        if (!lines.alive(i)) continue;
        sums[i] += weights_[step] * noiseAt(lines.point(i));
        steps[i] = step;
      }
    }
  }

  /// Of the sum over so many steps to either side of the point.
  double variance(std::size_t forwards, std::size_t backwards) const {
    const auto reach = static_cast<std::ptrdiff_t>(std::max(forwards, backwards));
    auto weight = [&](std::ptrdiff_t i) {
      if (i > static_cast<std::ptrdiff_t>(forwards) || -i > static_cast<std::ptrdiff_t>(backwards))
        return 0.0;
      return weights_[static_cast<std::size_t>(std::abs(i))];
    };
    double sum = 0;
    for (std::ptrdiff_t i = -reach; i <= reach; ++i) {
      sum += weight(i) * weight(i);
      for (std::ptrdiff_t j = 1; j < static_cast<std::ptrdiff_t>(correlation_.size()) && i + j <= reach;
           ++j) {
        sum += 2 * weight(i) * weight(i + j) * correlation_[static_cast<std::size_t>(j)];
      }
    }
    return sum;
  }

  LineIntegralOptions options_;
  std::vector<double> weights_, correlation_;
  double wholeVariance_ = 0;
};

}  // namespace

void LineIntegralOptions::validate() const {
  auto require = [](double value, const char* name) {
    if (!(value > 0 && std::isfinite(value))) {
      throw Error(Errc::usage, std::string("fibers: ") + name + " has to be positive");
    }
  };
  require(length, "length");
  require(thickness, "thickness");
  require(contrast, "contrast");
  if (length > 1e4 * thickness)
    throw Error(Errc::usage, "fibers: length is over 10000 times their thickness");
}

void lineIntegral(std::span<const Vec3> points, const FiberField& field, const LineIntegralOptions& options,
                  std::span<float> values, Context& context) {
  options.validate();
  const Convolution convolution(options);
  detail::parallelChunks(points.size(), kChunk, context, [&](std::size_t begin, std::size_t end) {
    convolution.run(points.subspan(begin, end - begin), field, values.subspan(begin, end - begin));
  });
}

}  // namespace polestar
