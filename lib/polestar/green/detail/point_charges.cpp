#include "polestar/green/detail/point_charges.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/simd_math.h"

// Compiled with -fopenmp-simd (see CMakeLists.txt of this folder).

namespace polestar::detail {
namespace {

// Charges are passed over in tiles that stay in the first-level cache while a block of points visits them.
constexpr std::size_t kTile = 1024;
constexpr std::size_t kSingleTile = 256;  // summed in single precision

POLESTAR_SIMD_CLONES
double tilePotential(const double* x, const double* y, const double* z, const double* charge,
                     std::size_t count, double px, double py, double pz, double squaredSoftening) {
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t j = 0; j < count; ++j) {
    const double dx = px - x[j], dy = py - y[j], dz = pz - z[j];
    sum += charge[j] * inverseRoot(squaredSoftening + dx * dx + dy * dy + dz * dz);
  }
  return sum;
}

POLESTAR_SIMD_CLONES
float tilePotential(const float* x, const float* y, const float* z, const float* charge, std::size_t count,
                    float px, float py, float pz, float squaredSoftening) {
  float sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t j = 0; j < count; ++j) {
    const float dx = px - x[j], dy = py - y[j], dz = pz - z[j];
    sum += charge[j] / __builtin_sqrtf(squaredSoftening + dx * dx + dy * dy + dz * dz);
  }
  return sum;
}

POLESTAR_SIMD_CLONES
void tilePotentialAndGradient(const double* x, const double* y, const double* z, const double* charge,
                              std::size_t count, double px, double py, double pz, double squaredSoftening,
                              double* result) {
  double sum = 0, gx = 0, gy = 0, gz = 0;
#pragma omp simd reduction(+ : sum, gx, gy, gz)
  for (std::size_t j = 0; j < count; ++j) {
    const double dx = px - x[j], dy = py - y[j], dz = pz - z[j];
    const double inverse = inverseRoot(squaredSoftening + dx * dx + dy * dy + dz * dz);
    const double term = charge[j] * inverse;
    const double slope = term * inverse * inverse;
    sum += term;
    gx -= slope * dx;
    gy -= slope * dy;
    gz -= slope * dz;
  }
  result[0] += sum;
  result[1] += gx;
  result[2] += gy;
  result[3] += gz;
}

}  // namespace

std::vector<Vec3> positionsOf(const PointCharges& charges) {
  std::vector<Vec3> result(charges.size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = Vec3(charges.x[i], charges.y[i], charges.z[i]);
  return result;
}

void sumPotential(const PointCharges& q, std::span<const Vec3> points, std::span<double> potential) {
  std::fill(potential.begin(), potential.end(), 0.0);
  for (std::size_t begin = 0; begin < q.size(); begin += kTile) {
    const std::size_t count = std::min(kTile, q.size() - begin);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3& p = points[i];
      potential[i] += tilePotential(&q.x[begin], &q.y[begin], &q.z[begin], &q.charge[begin], count, p[0],
                                    p[1], p[2], q.squaredSoftening);
    }
  }
}

void sumPotential(const SinglePointCharges& q, std::span<const Eigen::Vector3f> points,
                  std::span<double> potential) {
  std::fill(potential.begin(), potential.end(), 0.0);
  for (std::size_t begin = 0; begin < q.size(); begin += kSingleTile) {
    const std::size_t count = std::min(kSingleTile, q.size() - begin);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3f& p = points[i];
      potential[i] +=
          static_cast<double>(tilePotential(&q.x[begin], &q.y[begin], &q.z[begin], &q.charge[begin], count,
                                            p[0], p[1], p[2], q.squaredSoftening));
    }
  }
}

void sumPotentialAndGradient(const PointCharges& q, std::span<const Vec3> points, std::span<double> potential,
                             std::span<Vec3> gradient) {
  std::fill(potential.begin(), potential.end(), 0.0);
  std::fill(gradient.begin(), gradient.end(), Vec3::Zero());
  for (std::size_t begin = 0; begin < q.size(); begin += kTile) {
    const std::size_t count = std::min(kTile, q.size() - begin);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3& p = points[i];
      double result[4] = {potential[i], gradient[i][0], gradient[i][1], gradient[i][2]};
      tilePotentialAndGradient(&q.x[begin], &q.y[begin], &q.z[begin], &q.charge[begin], count, p[0], p[1],
                               p[2], q.squaredSoftening, result);
      potential[i] = result[0];
      gradient[i] = Vec3(result[1], result[2], result[3]);
    }
  }
}

}  // namespace polestar::detail
