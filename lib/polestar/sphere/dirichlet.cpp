#include "polestar/sphere/detail/dirichlet.h"

#include <numbers>
#include <utility>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kChunk = 2048;

std::vector<double> preconditionerShift(const std::vector<double>& massShares) {
  // On the sphere the Hessian is about L - 2 m (m the area of the image of a vertex), with the conformal maps
  // as its null space. A small positive multiple keeps the smooth fields close to right and the matrix
  // definite.
  std::vector<double> shift(massShares.size());
  for (std::size_t i = 0; i < shift.size(); ++i) shift[i] = 4 * std::numbers::pi * massShares[i];
  return shift;
}

}  // namespace

DirichletEnergy::DirichletEnergy(Laplacian laplacian, std::vector<double> massShares,
                                 std::span<const Vec3> positions)
    : laplacian_(std::move(laplacian)),
      massShares_(std::move(massShares)),
      preconditioner_(
          std::make_unique<ShiftedLaplacian>(laplacian_, preconditionerShift(massShares_), positions)) {}

double DirichletEnergy::evaluate(std::span<const Vec3> points, std::span<Vec3> gradient) const {
  struct Sums {
    double energy = 0;
    Vec3 center = Vec3::Zero();
  };
  const Sums sums = reduceChunks(
      points.size(), kChunk, Sums{},
      [&](std::size_t begin, std::size_t end) {
        Sums part;
        for (std::size_t i = begin; i < end; ++i) {
          Vec3 pull = Vec3::Zero();
          for (std::size_t e = laplacian_.rowStart[i]; e < laplacian_.rowStart[i + 1]; ++e) {
            const Vec3 difference = points[i] - points[laplacian_.column[e]];
            pull += laplacian_.weight[e] * difference;
            part.energy += 0.25 * laplacian_.weight[e] * difference.squaredNorm();
          }
          part.center += massShares_[i] * points[i];
          if (!gradient.empty()) gradient[i] = pull;
        }
        return part;
      },
      [](Sums a, const Sums& b) {
        a.energy += b.energy;
        a.center += b.center;
        return a;
      });
  if (!gradient.empty()) {
    parallelChunks(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        gradient[i] += 2 * kCenterPenalty * massShares_[i] * sums.center;
    });
  }
  return sums.energy + kCenterPenalty * sums.center.squaredNorm();
}

void DirichletEnergy::precondition(std::span<const Vec3> gradient, std::span<Vec3> out) const {
  preconditioner_->solve(gradient, out);
}

}  // namespace polestar::detail
