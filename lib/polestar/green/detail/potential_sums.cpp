#include "polestar/green/detail/potential_sums.h"

#include <utility>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

// Points per block of a parallel sum: enough to reuse a tile of charges, few enough to balance threads.
constexpr std::size_t kPointBlock = 32;

}  // namespace

DirectSums::DirectSums(PointCharges places, std::vector<Vec3> targets)
    : places_(std::move(places)), targets_(std::move(targets)) {}

PointCharges DirectSums::withCharges(std::span<const double> charge) const {
  PointCharges charges = places_;  // a copy, since callers on other threads bring other charges
  charges.charge.assign(charge.begin(), charge.end());
  return charges;
}

void DirectSums::potential(std::span<const double> charge, std::span<double> potential,
                           const Context& context) const {
  const PointCharges charges = withCharges(charge);
  parallelChunks(targets_.size(), kPointBlock, context, [&](std::size_t begin, std::size_t end) {
    sumPotential(charges, std::span(targets_).subspan(begin, end - begin),
                 potential.subspan(begin, end - begin));
  });
}

DirectChargeField::DirectChargeField(PointCharges charges) : charges_(std::move(charges)) {}

void DirectChargeField::evaluate(std::span<const Vec3> points, std::span<double> potential,
                                 std::span<Vec3> gradient, const Context& context) const {
  auto block = [&](std::size_t begin, std::size_t end) {
    sumPotentialAndGradient(charges_, points.subspan(begin, end - begin),
                            potential.subspan(begin, end - begin), gradient.subspan(begin, end - begin));
  };
  if (points.size() <= kPointBlock) {
    context.throwIfCancelled();
    block(0, points.size());
  } else {
    parallelChunks(points.size(), kPointBlock, context, block);
  }
}

}  // namespace polestar::detail
