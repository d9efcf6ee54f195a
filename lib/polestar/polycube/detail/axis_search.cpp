#include "polestar/polycube/detail/axis_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/rotations.h"

namespace polestar::detail {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

std::vector<double> scores(const std::vector<Mat3>& axes, const std::function<double(const Mat3&)>& score,
                           const Context& context) {
  std::vector<double> result(axes.size());
  parallelChunks(axes.size(), 1, context,
                 [&](std::size_t begin, std::size_t) { result[begin] = score(axes[begin]); });
  return result;
}

struct Climber {
  Mat3 axes;
  double score;
  double step;  ///< radians
};

Mat3 turned(const Mat3& axes, int axis, double angle) {
  return axes * Eigen::AngleAxisd(angle, Vec3::Unit(axis)).toRotationMatrix();
}

}  // namespace

const std::vector<Mat3>& latticeSymmetries() {
  static const std::vector<Mat3> symmetries = [] {
    std::vector<Mat3> result;
    for (int first = 0; first < 3; ++first) {
      for (const int order : {1, 2}) {
        for (const double a : {1.0, -1.0}) {
          for (const double b : {1.0, -1.0}) {
            Mat3 m;
            m.col(0) = a * Vec3::Unit(first);
            m.col(1) = b * Vec3::Unit((first + order) % 3);
            m.col(2) = m.col(0).cross(m.col(1));
            result.push_back(m);
          }
        }
      }
    }
    return result;
  }();
  return symmetries;
}

std::vector<Mat3> spreadLattices(int count) {
  const std::vector<Mat3>& symmetries = latticeSymmetries();
  std::vector<Mat3> rotations = spreadRotations(count * static_cast<int>(symmetries.size()));
  // Of the rotations that turn the lattice alike, the one that turns least.
  std::erase_if(rotations, [&](const Mat3& rotation) {
    return std::ranges::any_of(
        symmetries, [&](const Mat3& symmetry) { return rotation.trace() < (rotation * symmetry).trace(); });
  });
  return rotations;
}

Mat3 nearestToIdentity(const Mat3& axes, const std::vector<Mat3>& symmetries) {
  Mat3 nearest = axes;
  for (const Mat3& symmetry : symmetries) {
    const Mat3 renamed = axes * symmetry;
    if (renamed.trace() > nearest.trace()) nearest = renamed;
  }
  return nearest;
}

std::vector<Mat3> bestAxes(const std::vector<Mat3>& candidates,
                           const std::function<double(const Mat3&)>& score, const Context& context) {
  constexpr std::size_t kClimbers = 4;
  constexpr double kFirstStep = 8 * kDegree, kLastStep = 0.5 * kDegree;  // 64 rotations are 20 degrees apart
  constexpr double kGain = 1e-5;                                         // of the score, less is noise
  const std::vector<double> first = scores(candidates, score, context);
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return first[a] > first[b]; });

  std::vector<Climber> climbers;
  for (std::size_t i = 0; i < std::min(kClimbers, order.size()); ++i)
    climbers.push_back({candidates[order[i]], first[order[i]], kFirstStep});
  for (;;) {
    std::vector<Mat3> trials;
    for (const Climber& climber : climbers) {
      if (climber.step < kLastStep) continue;
      for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {1.0, -1.0})
          trials.push_back(turned(climber.axes, axis, sign * climber.step));
      }
    }
    if (trials.empty()) break;
    const std::vector<double> found = scores(trials, score, context);
    auto trial = found.begin();
    for (Climber& climber : climbers) {
      if (climber.step < kLastStep) continue;
      const auto best = std::max_element(trial, trial + 6);
      if (*best > climber.score + kGain) {
        climber.axes = trials[best - found.begin()];
        climber.score = *best;
      } else {
        climber.step /= 2;
      }
      trial += 6;
    }
  }
  std::ranges::stable_sort(climbers, std::greater<>(), &Climber::score);
  std::vector<Mat3> ends;
  for (const Climber& climber : climbers) ends.push_back(climber.axes);
  return ends;
}

}  // namespace polestar::detail
