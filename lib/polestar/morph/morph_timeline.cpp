#include "polestar/morph/morph_timeline.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "polestar/core/error.h"

namespace polestar {
namespace {

std::vector<double> checkedWeights(std::vector<double> weights) {
  constexpr double kSlack = 1e-6;  // of decimals that were typed
  double sum = 0;
  for (const double weight : weights) {
    if (!(weight >= 0))
      throw Error(Errc::usage, "weights of shapes cannot be negative; they are shares of 1");
    sum += weight;
  }
  if (!(std::abs(sum - 1) <= kSlack))
    throw Error(Errc::usage, "the weights of the shapes sum to " + std::to_string(sum) + ", not to 1");
  for (double& weight : weights) weight /= sum;
  return weights;
}

}  // namespace

const char* toString(Ease ease) {
  switch (ease) {
    case Ease::linear:
      return "linear";
    case Ease::smooth:
      return "smooth";
    case Ease::in:
      return "in";
    case Ease::out:
      break;
  }
  return "out";
}

double eased(Ease ease, double t) {
  switch (ease) {
    case Ease::linear:
      return t;
    case Ease::smooth:
      return t * t * (3 - 2 * t);
    case Ease::in:
      return t * t;
    case Ease::out:
      break;
  }
  return t * (2 - t);
}

MorphTimeline MorphTimeline::passage(std::size_t shapes, int first, int last, Ease ease) {
  if (shapes < 2) throw Error(Errc::usage, "a morph needs two shapes at least");
  if (last <= first)
    throw Error(Errc::usage, "a passage from shape to shape takes two frames at least, such as 1-48");
  MorphTimeline timeline;
  for (std::size_t i = 0; i < shapes; ++i) {
    timeline.keys_.emplace_back(shapes, 0.0);
    timeline.keys_.back()[i] = 1;
  }
  timeline.first_ = first;
  timeline.last_ = last;
  timeline.ease_ = ease;
  return timeline;
}

MorphTimeline MorphTimeline::still(std::vector<double> weights) { return keyed(0, 0, {std::move(weights)}); }

MorphTimeline MorphTimeline::keyed(int first, int last, std::vector<std::vector<double>> rows) {
  if (rows.empty()) throw Error(Errc::usage, "there are no weights");
  if (rows.size() > 1 && last <= first)
    throw Error(Errc::usage, "lines of weights need a frame each; the frames do not rise");
  MorphTimeline timeline;
  for (std::vector<double>& row : rows) {
    if (row.size() != rows.front().size() || row.empty())
      throw Error(Errc::usage, "there has to be one weight a shape in every line of weights");
    timeline.keys_.push_back(checkedWeights(row));
  }
  timeline.first_ = first;
  timeline.last_ = last;
  return timeline;
}

double MorphTimeline::position(double frame) const {
  if (keys_.size() == 1) return 0;
  const double t = std::clamp((frame - first_) / (last_ - first_), 0.0, 1.0);
  return eased(ease_, t) * static_cast<double>(keys_.size() - 1);
}

std::vector<double> MorphTimeline::weights(double frame) const {
  const double at = position(frame);
  const auto segment = std::min(static_cast<std::size_t>(at), std::max<std::size_t>(keys_.size(), 2) - 2);
  const double share = at - static_cast<double>(segment);
  const std::vector<double>&from = keys_[segment], &to = keys_[std::min(segment + 1, keys_.size() - 1)];
  std::vector<double> weights(from.size());
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = (1 - share) * from[i] + share * to[i];
  return weights;
}

std::vector<double> MorphTimeline::rates(double frame) const {
  std::vector<double> rates(shapeCount(), 0.0);
  if (keys_.size() == 1) return rates;
  // Exact for what is linear on both sides; of the eases, which are parabolas and cubics, to 1e-12.
  const double step = 1e-6 * (last_ - first_);
  const double before = std::clamp(frame - step, first_, last_),
               after = std::clamp(frame + step, first_, last_);
  if (!(after > before)) return rates;
  const std::vector<double> low = weights(before), high = weights(after);
  for (std::size_t i = 0; i < rates.size(); ++i) rates[i] = (high[i] - low[i]) / (after - before);
  return rates;
}

}  // namespace polestar
