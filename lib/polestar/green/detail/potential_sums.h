#pragma once
// Sums over pairs of point charges and points behind two interfaces, so that the solver and the field need
// not know who adds them up: the CPU pair by pair (here), an OpenCL device (device_sums.h) or a fast method.

#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/green/detail/point_charges.h"

namespace polestar::detail {

/// Potentials of point charges at fixed places, at fixed targets: one plan, many right-hand sides.
class PotentialSums {
 public:
  virtual ~PotentialSums() = default;
  /// potential[i] = sum over j of charge[j] / sqrt(|target i - place j|^2 + softening^2).
  ///
  /// Thread-safe; the same bytes for any number of threads.
  /// @throws Error{Errc::cancelled}
  virtual void potential(std::span<const double> charge, std::span<double> potential,
                         const Context& context) const = 0;
};

/// Potential and gradient of fixed charges, at whatever points are asked.
class ChargeField {
 public:
  virtual ~ChargeField() = default;
  /// Kernel as above. Thread-safe: tracers call it with small batches from many threads.
  /// @throws Error{Errc::cancelled}
  virtual void evaluate(std::span<const Vec3> points, std::span<double> potential, std::span<Vec3> gradient,
                        const Context& context) const = 0;
  /// What the potential may miss anywhere for the method's sake, as a bound; rounding is not in it.
  virtual double truncation() const { return 0; }
};

/// Pair by pair on the CPU, in parallel. Time proportional to charges times targets, memory to their sum.
class DirectSums final : public PotentialSums {
 public:
  /// Of `places`, positions and softening count.
  DirectSums(PointCharges places, std::vector<Vec3> targets);
  std::span<const Vec3> targets() const { return targets_; }
  /// The places with these charges.
  PointCharges withCharges(std::span<const double> charge) const;
  void potential(std::span<const double> charge, std::span<double> potential,
                 const Context& context) const override;

 private:
  PointCharges places_;
  std::vector<Vec3> targets_;
};

/// The same for a field; batches too small to share are summed by the calling thread.
class DirectChargeField final : public ChargeField {
 public:
  explicit DirectChargeField(PointCharges charges);
  void evaluate(std::span<const Vec3> points, std::span<double> potential, std::span<Vec3> gradient,
                const Context& context) const override;

 private:
  PointCharges charges_;
};

}  // namespace polestar::detail
