#pragma once
// The pair sums on one OpenCL device, as long as nothing fails there; device_sums.h is what callers want.

#include <span>
#include <string>

#include "polestar/core/context.h"
#include "polestar/core/detail/opencl.h"
#include "polestar/green/detail/point_charges.h"

namespace polestar::detail {

/// Kernels built for a device, and its queue. One caller at a time.
class PairKernels {
 public:
  /// `source` as kPairSumsKernel. @throws OpenClError, with the compiler's words when it refuses `source`.
  PairKernels(OpenClApi api, const OpenClDevice& device, const std::string& source, bool doublePrecision);

  bool doublePrecision() const { return doublePrecision_; }

  /// As sumPotential (`gradient` empty) and sumPotentialAndGradient. Memory on the device: charges, and
  /// targets by the slice. Looks at `context` between launches of bounded size and leaves nothing running
  /// behind.
  /// @throws OpenClError; Error{Errc::cancelled}
  void sum(const PointCharges& charges, std::span<const Vec3> points, std::span<double> potential,
           std::span<Vec3> gradient, const Context& context) const;

 private:
  struct Kernel {
    OpenClOwner<cl_program> program;
    OpenClOwner<cl_kernel> kernel;
  };
  struct Charges {
    cl_mem buffer;
    std::size_t count;
    double squaredSoftening;
  };

  Kernel build(const OpenClDevice& device, const std::string& source, bool gradient) const;
  OpenClOwner<cl_mem> allocate(cl_mem_flags use, std::size_t bytes) const;
  template <class Real>
  OpenClOwner<cl_mem> upload(const std::vector<Real>& values) const;
  template <class Real>
  void sumAs(const PointCharges& charges, std::span<const Vec3> points, std::span<double> potential,
             std::span<Vec3> gradient, const Context& context) const;
  template <class Real>
  void sumSlice(const Charges& charges, std::span<const Vec3> points, std::span<double> potential,
                std::span<Vec3> gradient, const Context& context) const;
  void launchAll(cl_kernel kernel, std::size_t vectors, std::size_t chargeCount,
                 const Context& context) const;

  OpenClApi api_;
  bool doublePrecision_;
  std::size_t width_;  ///< targets of a work-item
  std::size_t local_;  ///< work-items of a group
  OpenClOwner<cl_context> context_;
  OpenClOwner<cl_command_queue> queue_;
  Kernel potential_, potentialAndGradient_;
};

}  // namespace polestar::detail
