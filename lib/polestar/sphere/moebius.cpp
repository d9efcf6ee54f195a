#include "polestar/sphere/detail/moebius.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace polestar::detail {
namespace {

constexpr int kMaxSteps = 100;
constexpr double kDone = 1e-15;

Vec3 weightedMean(std::span<const Vec3> points, std::span<const double> shares) {
  Vec3 mean = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) mean += shares[i] * points[i];
  return mean;
}

}  // namespace

void moebiusTranslate(std::span<Vec3> points, const Vec3& shift) {
  const double factor = 1 - shift.squaredNorm();
  for (Vec3& s : points) {
    const Vec3 y = s + shift;
    s = (factor / y.squaredNorm() * y + shift).normalized();
  }
}

double centerByMoebius(std::span<Vec3> points, std::span<const double> shares) {
  std::vector<Vec3> trial(points.size());
  Vec3 mean = weightedMean(points, shares);
  for (int step = 0; step < kMaxSteps && mean.norm() > kDone; ++step) {
    // Derivative of the mean by the shift: 2 sum_i share_i (1 - s_i s_i^T).
    Mat3 derivative = Mat3::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      derivative += 2 * shares[i] * (Mat3::Identity() - points[i] * points[i].transpose());
    }
    Vec3 shift = -derivative.ldlt().solve(mean);
    if (shift.norm() > 0.5) shift *= 0.5 / shift.norm();
    bool closer = false;
    for (int halvings = 0; halvings < 30 && !closer; ++halvings, shift *= 0.5) {
      trial.assign(points.begin(), points.end());
      moebiusTranslate(trial, shift);
      const Vec3 trialMean = weightedMean(trial, shares);
      if (!(trialMean.norm() < mean.norm())) continue;
      closer = true;
      mean = trialMean;
      std::copy(trial.begin(), trial.end(), points.begin());
    }
    if (!closer) break;  // rounding
  }
  return mean.norm();
}

}  // namespace polestar::detail
