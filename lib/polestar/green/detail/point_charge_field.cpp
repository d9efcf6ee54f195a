#include "polestar/green/detail/point_charge_field.h"

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kPointBlock = 32;  // reuses a tile of charges, and balances threads

}  // namespace

PointChargeField::PointChargeField(const PointSources& sources) {
  for (const Vec3& p : sources.positions) {
    charges_.x.push_back(p[0]);
    charges_.y.push_back(p[1]);
    charges_.z.push_back(p[2]);
  }
  charges_.charge = sources.charges;
}

void PointChargeField::evaluate(std::span<const Vec3> points, std::span<double> h,
                                std::span<Vec3> gradient) const {
  auto block = [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    sumPotentialAndGradient(charges_, points.subspan(begin, count), h.subspan(begin, count),
                            gradient.subspan(begin, count));
  };
  if (points.size() <= kPointBlock) {
    block(0, points.size());
  } else {
    parallelChunks(points.size(), kPointBlock, block);
  }
}

void PointChargeField::evaluatePotential(std::span<const Vec3> points, std::span<double> h,
                                         const Context& context) const {
  parallelChunks(points.size(), kPointBlock, context, [&](std::size_t begin, std::size_t end) {
    sumPotential(charges_, points.subspan(begin, end - begin), h.subspan(begin, end - begin));
  });
}

}  // namespace polestar::detail
