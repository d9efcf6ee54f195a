#pragma once
// Gradients of point charges at points that are known beforehand, with a bound for what the fast multipole
// method leaves out of them.

#include <memory>
#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/green/detail/octree.h"
#include "polestar/green/detail/point_charges.h"

namespace polestar::detail {

class GradientSums {
 public:
  /// Kernel as in ChargeField. The trees are built once: O(n log n) of charges plus points.
  GradientSums(const PointCharges& charges, std::span<const Vec3> points);

  /// What gradients by expansions of this order may miss, one bound a point; rounding is not in it.
  std::vector<double> truncation(int order) const;
  /// In parallel, the same bytes for any number of threads. @throws Error{Errc::cancelled}
  void evaluate(int order, std::span<Vec3> gradient, const Context& context) const;

 private:
  SourceTree sources_;
  TargetTree targets_;
  PointCharges sorted_;  // in the tree's order
};

}  // namespace polestar::detail
