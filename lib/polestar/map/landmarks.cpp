#include "polestar/map/landmarks.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "polestar/core/error.h"
#include "polestar/map/detail/landmark_flow.h"
#include "polestar/map/shell_map.h"

namespace polestar {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSamePlace = 1 * kDegree;    // pairs nearer than this ask for the same thing ...
constexpr double kSameAnswer = 10 * kDegree;  // ... and contradict each other when this far apart
constexpr double kHopeless = 60 * kDegree;
constexpr double kPullWeight = 0.02;  // so weak that three pairs are met to a fraction of a degree

double angleBetween(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Six numbers: the rotation as an axis times its angle, and the pull's rapidity: |pull| = tanh of its
/// length.
using Parameters = std::array<double, 6>;

template <class Number>
void pullOf(const Number* rapidity, Number* pull) {
  const Number squared = rapidity[0] * rapidity[0] + rapidity[1] * rapidity[1] + rapidity[2] * rapidity[2];
  // tanh(t) / t; smooth at 0.
  Number factor = Number(1) - squared / Number(3);
  if (squared > Number(1e-6)) {
    const Number length = sqrt(squared);
    factor = tanh(length) / length;
  }
  for (int k = 0; k < 3; ++k) pull[k] = factor * rapidity[k];
}

struct PairResidual {
  Vec3 from, to;
  double factor;  ///< root of the weight

  template <class Number>
  bool operator()(const Number* parameters, Number* residual) const {
    Number a[3], moved[3], turned[3];
    pullOf(parameters + 3, a);
    const Number ad = a[0] * from[0] + a[1] * from[1] + a[2] * from[2];
    const Number aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
    const Number bottom = Number(1) + Number(2) * ad + aa;
    for (int k = 0; k < 3; ++k)
      moved[k] = (Number(2) * (Number(1) + ad) * a[k] + (Number(1) - aa) * Number(from[k])) / bottom;
    ceres::AngleAxisRotatePoint(parameters, moved, turned);
    for (int k = 0; k < 3; ++k) residual[k] = Number(factor) * (turned[k] - Number(to[k]));
    return true;
  }
};

struct PullResidual {
  template <class Number>
  bool operator()(const Number* parameters, Number* residual) const {
    for (int k = 0; k < 3; ++k) residual[k] = Number(kPullWeight) * parameters[3 + k];
    return true;
  }
};

/// Rotation that brings the directions closest, least squares [Kabsch 1976]; of two or fewer, the smallest
/// one that does.
Mat3 bestRotation(std::span<const LandmarkPair> pairs) {
  if (pairs.size() == 1) return Eigen::Quaterniond::FromTwoVectors(pairs[0].from, pairs[0].to).matrix();
  Mat3 sum = Mat3::Zero();
  for (const LandmarkPair& pair : pairs) sum += pair.weight * pair.to * pair.from.transpose();
  const Eigen::JacobiSVD<Mat3> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 sign = Mat3::Identity();
  sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

double refine(std::span<const LandmarkPair> pairs, int iterations, Parameters& parameters) {
  ceres::Problem problem;
  for (const LandmarkPair& pair : pairs) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PairResidual, 3, 6>(
                                 new PairResidual{pair.from, pair.to, std::sqrt(pair.weight)}),
                             nullptr, parameters.data());
  }
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PullResidual, 3, 6>(new PullResidual), nullptr,
                           parameters.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = iterations;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-14;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.final_cost;
}

/// The 24 rotations that bring a cube onto itself.
std::vector<Mat3> cubeRotations() {
  std::vector<Mat3> rotations;
  for (int x = 0; x < 3; ++x) {
    for (int signs = 0; signs < 8; ++signs) {
      // The first axis, one of six; the second, one of the four that are left.
      const Vec3 first = (signs & 1 ? -1 : 1) * Vec3::Unit(x);
      const Vec3 second = (signs & 2 ? -1 : 1) * Vec3::Unit((x + (signs & 4 ? 2 : 1)) % 3);
      Mat3 rotation;
      rotation << first, second, first.cross(second);
      rotations.push_back(rotation);
    }
  }
  return rotations;
}

struct Candidate {
  double cost = std::numeric_limits<double>::infinity();
  Parameters parameters{};
};

/// A few steps tell which of the starts are worth finishing.
BallMotion bestMotion(std::span<const LandmarkPair> pairs) {
  constexpr int kFirstSteps = 8, kAllSteps = 200;
  constexpr std::size_t kFinished = 3;
  const Mat3 rotation = bestRotation(pairs);
  if (pairs.size() < 3) return BallMotion(rotation);
  std::vector<Candidate> candidates;
  for (const Mat3& first : cubeRotations()) {
    Candidate candidate;
    const Eigen::AngleAxisd turn(Mat3(rotation * first));
    for (int k = 0; k < 3; ++k) candidate.parameters[k] = turn.angle() * turn.axis()[k];
    candidate.cost = refine(pairs, kFirstSteps, candidate.parameters);
    candidates.push_back(candidate);
  }
  const auto cheaper = [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; };
  std::stable_sort(candidates.begin(), candidates.end(), cheaper);
  candidates.resize(kFinished);
  for (Candidate& candidate : candidates) candidate.cost = refine(pairs, kAllSteps, candidate.parameters);
  const Parameters best = std::min_element(candidates.begin(), candidates.end(), cheaper)->parameters;
  Vec3 pull, turn(best[0], best[1], best[2]);
  pullOf(best.data() + 3, pull.data());
  const double angle = turn.norm();
  const Mat3 turned =
      angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Mat3(Mat3::Identity());
  return BallMotion(turned, pull);
}

std::string degrees(double angle) {
  std::ostringstream text;
  text.precision(3);
  text << angle / kDegree << " degrees";
  return text.str();
}

/// With directions of length 1 and weights whose mean is 1.
std::vector<LandmarkPair> normalizedPairs(std::span<const LandmarkPair> pairs) {
  if (pairs.empty()) throw Error(Errc::usage, "landmarks: there are none");
  std::vector<LandmarkPair> unit;
  double weights = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const LandmarkPair& pair = pairs[i];
    const std::string name = "landmarks: pair " + std::to_string(i + 1);
    if (!(pair.from.allFinite() && pair.to.allFinite() && pair.from.norm() > 0 && pair.to.norm() > 0))
      throw Error(Errc::usage, name + " has a place that gives no direction");
    if (!(pair.weight > 0 && std::isfinite(pair.weight)))
      throw Error(Errc::usage, name + " has a weight that is not positive");
    unit.push_back({pair.from.normalized(), pair.to.normalized(), pair.weight});
    weights += pair.weight;
  }
  for (LandmarkPair& pair : unit) pair.weight *= static_cast<double>(pairs.size()) / weights;
  return unit;
}

void refuseContradictions(std::span<const LandmarkPair> unit) {
  for (std::size_t i = 0; i < unit.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double from = angleBetween(unit[i].from, unit[j].from), to = angleBetween(unit[i].to, unit[j].to);
      if (std::min(from, to) >= kSamePlace || std::max(from, to) <= kSameAnswer) continue;
      throw Error(Errc::usage, "landmarks: pairs " + std::to_string(j + 1) + " and " + std::to_string(i + 1) +
                                   " contradict each other: " + degrees(std::min(from, to)) +
                                   " apart on one solid, " + degrees(std::max(from, to)) + " on the other");
    }
  }
}

/// Fills angles, rms and worst of a fit or a match.
template <class Result, class Image>
void measure(std::span<const LandmarkPair> pairs, const Image& image, Result& result) {
  double squares = 0;
  result.angles.clear();
  result.worst = 0;
  for (const LandmarkPair& pair : pairs) {
    const double angle = angleBetween(image(pair.from), pair.to);
    result.angles.push_back(angle);
    squares += pair.weight * angle * angle;
    result.worst = std::max(result.worst, angle);
  }
  result.rms = std::sqrt(squares / static_cast<double>(pairs.size()));
}

LandmarkFit fitted(std::span<const LandmarkPair> pairs) {
  LandmarkFit fit;
  fit.motion = bestMotion(pairs);
  fit.rotationOnly = pairs.size() < 3;
  measure(
      pairs, [&](const Vec3& from) { return fit.motion.ofDirection(from); }, fit);
  return fit;
}

/// @throws where no motion comes near
LandmarkFit checkedFit(std::span<const LandmarkPair> unit) {
  refuseContradictions(unit);
  LandmarkFit fit = fitted(unit);
  if (fit.worst <= kHopeless) return fit;
  std::vector<LandmarkPair> mirrored(unit.begin(), unit.end());
  for (LandmarkPair& pair : mirrored) pair.to.x() = -pair.to.x();
  const auto worst = std::max_element(fit.angles.begin(), fit.angles.end()) - fit.angles.begin();
  std::string message = "landmarks: no motion of the ball brings pair " + std::to_string(worst + 1) +
                        " nearer than " + degrees(fit.worst);
  message += fitted(mirrored).rms < 0.3 * fit.rms
                 ? "; one solid's places are mirrored: are left and right, or two columns, mixed up?"
                 : "; are rows mixed up?";
  throw Error(Errc::usage, message);
}

}  // namespace

LandmarkFit fitLandmarks(std::span<const LandmarkPair> pairs) { return checkedFit(normalizedPairs(pairs)); }

void MatchOptions::validate() const {
  if (!(tolerance > 0)) throw Error(Errc::usage, "MatchOptions: the tolerance must be positive");
  if (!(coreRadius > 0 && coreRadius < 1))
    throw Error(Errc::usage, "MatchOptions: the core's radius must lie in (0, 1)");
}

LandmarkMatch matchLandmarks(std::span<const LandmarkPair> pairs, const MatchOptions& options,
                             const Context& context) {
  options.validate();
  const std::vector<LandmarkPair> unit = normalizedPairs(pairs);
  const LandmarkFit fit = options.samples ? fitted(unit) : checkedFit(unit);
  LandmarkMatch match;
  match.rotationOnly = fit.rotationOnly;
  match.angles = fit.angles, match.rms = fit.rms, match.worst = fit.worst;
  match.rotation = fit.motion.rotation();
  match.motion = std::make_shared<BallMotion>(fit.motion.rotation(), fit.motion.pull(), options.coreRadius);
  if (!options.refine || fit.worst <= options.tolerance) return match;

  detail::LandmarkFlow flow(unit, fit.motion, !options.samples);
  match.stalled = flow.run(options.tolerance, options.samples, context);
  const auto shells = std::make_shared<ShellMap>(flow.table(), options.coreRadius);
  measure(
      unit, [&](const Vec3& from) { return shells->ofDirection(from); }, match);
  match.refined = true;
  match.rotationOnly = false;
  match.rotation = shells->rotation();
  match.largestDilatation = shells->largestDilatation();
  match.motion = shells;
  return match;
}

}  // namespace polestar
