#include "polestar/map/alignment.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/rotations.h"
#include "polestar/map/detail/surface_rays.h"
#include "polestar/mesh/bodies.h"
#include "polestar/sphere/reach.h"

namespace polestar {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kGridTurns = 3000;
constexpr std::size_t kRefined = 16;
/// Turns that differ by less are the same start and, refined, the same answer.
constexpr double kDistinct = 20 * kDegree;
constexpr double kAsGood = 0.02, kEqual = 1e-3;  // differences of correlations
/// Below it the best turn follows facets: a sphere of 642 vertices and a star reach 0.013.
constexpr double kLeastCorrelation = 0.1;
/// Standard deviation of ln r below which a solid is round: that of a sphere of 2,562 vertices is 2e-4.
constexpr double kRound = 1e-3;
constexpr int kCoarse = 8, kFine = 16;  // of geodesicSphere: 642 and 2,562 directions
constexpr int kPairs = 5;               // 252 directions

/// ln r of the surface in a direction of length 1.
double logRadius(const ReachTable& solid, const Vec3& direction) {
  return std::log(solid.reach(direction) / direction.cwiseAbs().maxCoeff());
}

/// Values over even directions, less their mean, in units of their standard deviation.
struct Standardized {
  std::vector<double> values;
  double deviation = 0;
};

Standardized standardized(std::vector<double> values) {
  const auto count = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const double v : values) sum += v;
  for (double& v : values) v -= sum / count, squares += v * v;
  const double deviation = std::sqrt(squares / count);
  for (double& v : values) v /= std::max(deviation, 1e-300);
  return {std::move(values), deviation};
}

/// Two solids' radii in given directions of the first.
class Comparison {
 public:
  Comparison(const ReachTable& from, const ReachTable& to, int frequency)
      : to_(to), directions_(geodesicSphere(frequency).vertices) {
    std::vector<double> values;
    for (const Vec3& u : directions_) values.push_back(logRadius(from, u));
    from_ = standardized(std::move(values));
  }

  bool round() const { return from_.deviation < kRound || turned(Mat3::Identity()).deviation < kRound; }
  const std::vector<Vec3>& directions() const { return directions_; }
  const std::vector<double>& values() const { return from_.values; }

  Standardized turned(const Mat3& rotation) const {
    std::vector<double> values;
    values.reserve(directions_.size());
    for (const Vec3& u : directions_) values.push_back(logRadius(to_, rotation * u));
    return standardized(std::move(values));
  }
  double correlation(const Mat3& rotation) const {
    const Standardized other = turned(rotation);
    double sum = 0;
    for (std::size_t i = 0; i < directions_.size(); ++i) sum += from_.values[i] * other.values[i];
    return sum / static_cast<double>(directions_.size());
  }

 private:
  const ReachTable& to_;
  std::vector<Vec3> directions_;
  Standardized from_;
};

/// Columns: axes of the solid's second moments about its center, longest first; right-handed. The moments
/// are integrals of r^5 / 5 over the directions.
Mat3 principalAxes(const ReachTable& radius, const std::vector<Vec3>& directions) {
  Mat3 moments = Mat3::Zero();
  for (const Vec3& u : directions) moments += std::exp(5 * logRadius(radius, u)) * u * u.transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(moments);
  Mat3 axes;
  axes << solver.eigenvectors().col(2), solver.eigenvectors().col(1),
      solver.eigenvectors().col(2).cross(solver.eigenvectors().col(1));
  return axes;
}

double angleBetween(const Mat3& a, const Mat3& b) {
  return Eigen::AngleAxisd(Mat3(a * b.transpose())).angle();
}

struct Candidate {
  Mat3 rotation;
  double correlation;
};

/// The best `most` of them, no two closer than kDistinct.
std::vector<Candidate> distinct(std::vector<Candidate> all, std::size_t most) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Candidate& a, const Candidate& b) { return a.correlation > b.correlation; });
  std::vector<Candidate> chosen;
  for (const Candidate& candidate : all) {
    if (chosen.size() == most) break;
    const bool isNew = std::none_of(chosen.begin(), chosen.end(), [&](const Candidate& other) {
      return angleBetween(candidate.rotation, other.rotation) < kDistinct;
    });
    if (isNew) chosen.push_back(candidate);
  }
  return chosen;
}

/// The difference of the standardized radii under turn * start; derivatives over half a degree, which see
/// past the kinks of what is interpolated.
class RadiusCost final : public ceres::CostFunction {
 public:
  RadiusCost(const Comparison& comparison, const Mat3& start) : comparison_(comparison), start_(start) {
    mutable_parameter_block_sizes()->push_back(3);
    set_num_residuals(static_cast<int>(comparison.directions().size()));
  }

  bool Evaluate(double const* const* turn, double* residuals, double** jacobians) const override {
    constexpr double kStep = 0.5 * kDegree;
    const Vec3 at(turn[0][0], turn[0][1], turn[0][2]);
    const std::vector<double> here = valuesAt(at);
    for (std::size_t i = 0; i < here.size(); ++i) residuals[i] = here[i] - comparison_.values()[i];
    if (!jacobians || !jacobians[0]) return true;
    for (int k = 0; k < 3; ++k) {
      const std::vector<double> after = valuesAt(at + kStep * Vec3::Unit(k)),
                                before = valuesAt(at - kStep * Vec3::Unit(k));
      for (std::size_t i = 0; i < here.size(); ++i)
        jacobians[0][3 * i + static_cast<std::size_t>(k)] = (after[i] - before[i]) / (2 * kStep);
    }
    return true;
  }

 private:
  std::vector<double> valuesAt(const Vec3& turn) const {
    Mat3 rotation;
    ceres::AngleAxisToRotationMatrix(turn.data(), ceres::ColumnMajorAdapter3x3(rotation.data()));
    return comparison_.turned(rotation * start_).values;
  }

  const Comparison& comparison_;
  const Mat3& start_;
};

Candidate refined(const Comparison& comparison, const Candidate& start) {
  std::array<double, 3> turn{};
  ceres::Problem problem;
  problem.AddResidualBlock(new RadiusCost(comparison, start.rotation), nullptr, turn.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 20;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  Mat3 rotation;
  ceres::AngleAxisToRotationMatrix(turn.data(), ceres::ColumnMajorAdapter3x3(rotation.data()));
  rotation = rotation * start.rotation;
  return {rotation, comparison.correlation(rotation)};
}

std::vector<Candidate> starts(const ReachTable& from, const ReachTable& to, const Context& context) {
  const Comparison comparison(from, to, kCoarse);
  std::vector<Mat3> rotations = spreadRotations(kGridTurns);
  const Mat3 axesFrom = principalAxes(from, comparison.directions()),
             axesTo = principalAxes(to, comparison.directions());
  // Axes have no sign: four ways to lay one right-handed frame over another.
  for (const Vec3& signs : {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)})
    rotations.push_back(axesTo * signs.asDiagonal() * axesFrom.transpose());
  rotations.push_back(Mat3::Identity());
  std::vector<Candidate> all(rotations.size());
  detail::parallelChunks(all.size(), 64, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) all[i] = {rotations[i], comparison.correlation(rotations[i])};
  });
  return distinct(std::move(all), kRefined);
}

Alignment nothingInCommon() {
  Alignment alignment;
  alignment.ambiguous = true;
  return alignment;
}

}  // namespace

Alignment alignSolids(const StarShape& from, const StarShape& to, const Context& context) {
  const ReachTable radiusFrom(from, context), radiusTo(to, context);
  const Comparison comparison(radiusFrom, radiusTo, kFine);
  if (comparison.round()) return nothingInCommon();
  Alignment alignment;
  alignment.correlationBefore = comparison.correlation(Mat3::Identity());
  std::vector<Candidate> found = starts(radiusFrom, radiusTo, context);
  detail::parallelChunks(found.size(), 1, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) found[i] = refined(comparison, found[i]);
  });
  const std::vector<Candidate> best = distinct(std::move(found), kRefined);
  if (best.front().correlation < kLeastCorrelation) return nothingInCommon();
  std::size_t chosen = 0;
  for (std::size_t i = 1; i < best.size() && best[i].correlation > best[0].correlation - kEqual; ++i) {
    if (angleBetween(best[i].rotation, Mat3::Identity()) <
        angleBetween(best[chosen].rotation, Mat3::Identity()))
      chosen = i;
  }
  alignment.rotation = best[chosen].rotation;
  alignment.correlation = best[chosen].correlation;
  if (best.size() > 1) {
    const Candidate& other = best[chosen == 0 ? 1 : 0];
    alignment.runnerUp = other.rotation;
    alignment.runnerUpCorrelation = other.correlation;
    alignment.ambiguous = other.correlation > alignment.correlation - kAsGood;
  }
  return alignment;
}

LandmarkMatch alignedMotion(const BallMap& from, const BallMap& to, const Mat3& rotation,
                            const MatchOptions& options, const Context& context) {
  const std::vector<Vec3> directions = geodesicSphere(kPairs).vertices;
  std::vector<Vec3> turned;
  for (const Vec3& u : directions) turned.push_back(rotation * u);
  const std::vector<detail::RayExit> onFrom = detail::rayExits(from, directions),
                                     onTo = detail::rayExits(to, turned);
  std::vector<LandmarkPair> pairs;
  for (std::size_t i = 0; i < directions.size(); ++i)
    pairs.push_back({onFrom[i].direction, onTo[i].direction});
  MatchOptions asSamples = options;
  asSamples.samples = true;
  return matchLandmarks(pairs, asSamples, context);
}

}  // namespace polestar
