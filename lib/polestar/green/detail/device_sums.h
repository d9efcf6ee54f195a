#pragma once
// The pair sums on an OpenCL device. Whatever fails there, the caller gets the CPU's sums and the log one
// line.

#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "polestar/core/compute_device.h"
#include "polestar/core/detail/opencl.h"
#include "polestar/green/detail/pair_kernels.h"
#include "polestar/green/detail/potential_sums.h"

namespace polestar::detail {

/// For tests, which break things on purpose; everybody else takes the default.
struct PairDeviceSettings {
  std::function<OpenClApi()> load{};  ///< empty: loadOpenCl()
  std::string kernel{};               ///< empty: kPairSumsKernel
  bool allowDouble = true;
};

/// An OpenCL device with the kernels built for it, shared by all sums of a computation. Thread-safe: callers
/// take turns.
///
/// Doubles where the device has them: as exact as the CPU's sums, rounded differently. Else single precision,
/// compensated: off by less than 1e-6 of the sum of the terms' magnitudes. The sum at a point depends on no
/// other point of its batch and on no thread count.
class PairDevice {
 public:
  /// Null when `choice` is the CPU; null, and why in the log, when there is no library, driver or device,
  /// when the kernel does not compile, or when its sums of a few charges are not those of the CPU.
  static std::shared_ptr<PairDevice> open(const DeviceChoice& choice, const Context& context,
                                          const PairDeviceSettings& settings = {});

  const std::string& name() const { return name_; }
  bool doublePrecision() const { return kernels_.doublePrecision(); }
  /// Of a sum, relative to that of its terms' magnitudes.
  double accuracy() const { return doublePrecision() ? 1e-14 : 1e-6; }
  /// False once a sum failed.
  bool works() const;

  /// As sumPotential (`gradient` empty) and sumPotentialAndGradient. False when the device fails, now or
  /// before, which is logged once: then the sums are not there and the CPU has to do it. Looks at `context`
  /// between launches, each a fraction of a second even on a device as slow as one core.
  /// @throws Error{Errc::cancelled}
  [[nodiscard]] bool sum(const PointCharges& charges, std::span<const Vec3> points,
                         std::span<double> potential, std::span<Vec3> gradient, const Context& context);

 private:
  PairDevice(std::string name, PairKernels kernels) : name_(std::move(name)), kernels_(std::move(kernels)) {}

  std::string name_;
  mutable std::mutex turn_;
  PairKernels kernels_;
  bool failed_ = false;
};

/// Sums at fixed targets on a device.
class DeviceSums final : public PotentialSums {
 public:
  DeviceSums(std::shared_ptr<PairDevice> device, PointCharges places, std::vector<Vec3> targets);
  void potential(std::span<const double> charge, std::span<double> potential,
                 const Context& context) const override;

 private:
  std::shared_ptr<PairDevice> device_;
  DirectSums cpu_;
};

}  // namespace polestar::detail
