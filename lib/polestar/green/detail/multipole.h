#pragma once
// The fast multipole method for point charges: sums over all pairs in time that grows with charges plus
// targets. [Greengard & Rokhlin 1987; adaptive lists: Carrier, Greengard & Rokhlin 1988]

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "polestar/green/detail/octree.h"
#include "polestar/green/detail/potential_sums.h"
#include "polestar/green/detail/translations.h"

namespace polestar::detail {

/// Largest error of a potential to be expected, relative to the largest potential, for charges spread over a
/// surface: 10^(-2.75 - 0.28 order). Seen, not proved: tests/bench/multipole_bench.cpp prints what is.
double truncationError(int order);
/// The order whose truncation error is at most `accuracy`, within [6, kMaxOrder]: 2e-11 is the least there
/// is.
int orderFor(double accuracy);

/// Precision of the sums over near pairs. Single takes half the time and rounds to some 1e-7 of the potential
/// on even surfaces, to 1e-4 beside spots that are a hundred times denser.
enum class PairPrecision { single, full };

/// Potentials of charges at fixed places, at fixed targets.
///
/// Errors: see truncationError. Memory: the lists, and (order + 1)^2 doubles a box.
class MultipoleSums final : public PotentialSums {
 public:
  /// Of `places`, positions and softening count; the softening is felt by near pairs alone, where it matters.
  MultipoleSums(const PointCharges& places, std::span<const Vec3> targets, int order,
                PairPrecision precision = PairPrecision::full);
  void potential(std::span<const double> charge, std::span<double> potential,
                 const Context& context) const override;
  /// The same places and targets with another order; shares the lists.
  MultipoleSums withOrder(int order, PairPrecision precision = PairPrecision::full) const;
  /// What the potentials of these charges may miss for the order's sake, one bound a target
  /// (TruncationBound).
  std::vector<double> truncation(std::span<const double> charge) const;

 private:
  struct Trees {
    SourceTree sources;
    TargetTree targets;
    double squaredSoftening;
  };
  MultipoleSums(std::shared_ptr<const Trees> trees, int order, PairPrecision precision);

  std::shared_ptr<const Trees> trees_;
  PairPrecision precision_;
  std::shared_ptr<const Translations> translations_;
};

/// Potential and gradient of fixed charges anywhere within a cube around them: local expansions are formed
/// once, each point then costs one evaluation of an expansion and some hundred near pairs.
class MultipoleField final : public ChargeField {
 public:
  /// Boxes are split down to `finest`, a length.
  /// @param truncation the order is raised until the bound of what it leaves out is at most this, or
  /// kMaxOrder reached
  MultipoleField(const PointCharges& charges, int order, double finest, const Context& context,
                 double truncation = std::numeric_limits<double>::infinity());
  /// @pre the points lie in the charges' bounding cube, or as good as in it.
  void evaluate(std::span<const Vec3> points, std::span<double> potential, std::span<Vec3> gradient,
                const Context& context) const override;
  double truncation() const override;

 private:
  int order_;
  SourceTree sources_;
  TargetTree targets_;
  PointCharges charges_;       // in the tree's order
  std::vector<double> local_;  // expansions of the target boxes
};

}  // namespace polestar::detail
