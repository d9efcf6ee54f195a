#pragma once
// What a fast multipole sum of finite order leaves out, as a bound that holds: no sampling, no law of
// experience.

#include <span>
#include <vector>

#include "polestar/green/detail/octree.h"
#include "polestar/green/detail/point_charges.h"

namespace polestar::detail {

/// Bounds for the terms that sums of degree `order` over these trees leave out.
///
/// The term of degree n in a charge q (at distance a_j from the center of its box) and m in the target (at
/// distance b from the center of its own), boxes r apart, is at most |q| C(n+m, n) a_j^n b^m / r^(n+m+1): the
/// k-th derivative of 1/r is k!/r^(k+1) in norm, and a symmetric form is largest on the diagonal [Banach
/// 1938]. A translation leaves out n > order (a bound for all m at once: the tail of the multipole expansion
/// at the distance of the target box), m > order (likewise, from the target's side), and counts twice what
/// both leave out, which the binomial bound takes. Charges enter by their own distances, by sum |q|
/// a_j^(order + 1). Moving expansions up and down a tree leaves nothing out.
///
/// The gradient of that term, a form of degree m in the target, is at most m/b times as large, by the same
/// theorem; that of the multipole expansion's term of degree n, (n + 1)/r times.
class TruncationBound {
 public:
  enum class Of { potential, gradient };

  /// @param sorted charges in the order of the source tree. O(charges times depth + translations).
  TruncationBound(const SourceTree& sources, const TargetTree& targets, const PointCharges& sorted, int order,
                  Of what = Of::potential);

  /// One number a target, in the order in which the targets were given. O(targets times depth).
  std::vector<double> atTargets() const;
  /// The largest anywhere in a leaf, for trees of targets that are not known beforehand.
  double anywhere() const;

 private:
  // Of one target box: what does not depend on the target, and what falls like a power of b/half diagonal:
  // order + 1 for potentials, order for gradients.
  struct Terms {
    double fixed = 0, growing = 0;
  };
  double at(std::uint32_t leaf, const Vec3& low, const Vec3& high) const;

  const SourceTree& sources_;
  const TargetTree& targets_;
  double power_;
  std::vector<Terms> terms_;
  std::vector<std::uint32_t> parent_;
};

}  // namespace polestar::detail
