#pragma once
// The field of point charges outside the solid.

#include "polestar/green/detail/point_charges.h"
#include "polestar/green/green_function.h"

namespace polestar::detail {

class PointChargeField final : public HarmonicField {
 public:
  explicit PointChargeField(const PointSources& sources);
  /// Direct sums, so the gradient is as exact as the value: on the surface, too.
  void evaluate(std::span<const Vec3> points, std::span<double> h, std::span<Vec3> gradient) const override;
  /// h alone, at half the price.
  void evaluatePotential(std::span<const Vec3> points, std::span<double> h, const Context& context) const;

 private:
  PointCharges charges_;
};

}  // namespace polestar::detail
