#include "polestar/green/detail/device_sums.h"

#include <cmath>
#include <utility>

#include "polestar/green/detail/pair_sums_kernel.h"

namespace polestar::detail {
namespace {

/// Points on spheres of radius `radius` times 1, 1/2, 1/3: as evenly as the golden angle spreads them.
std::vector<Vec3> spiral(std::size_t count, double radius) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double angle = 2.399963229728653 * static_cast<double>(i), ring = std::sqrt(1 - z * z);
    points.push_back(radius / static_cast<double>(1 + i % 3) *
                     Vec3(ring * std::cos(angle), ring * std::sin(angle), z));
  }
  return points;
}

// Drivers miscompile, and nothing later would notice: a few sums of known result, no multiple of any block.
void verify(const PairKernels& kernels, const Context& context) {
  PointCharges charges;
  for (const Vec3& p : spiral(301, 3)) {
    charges.x.push_back(p[0]);
    charges.y.push_back(p[1]);
    charges.z.push_back(p[2]);
    charges.charge.push_back(1 + p[0] / 4);
  }
  charges.squaredSoftening = 1e-12;
  const std::vector<Vec3> points = spiral(151, 0.8);
  std::vector<double> expected(points.size()), alone(points.size()), together(points.size());
  std::vector<Vec3> slope(points.size()), gradient(points.size());
  sumPotentialAndGradient(charges, points, expected, slope);
  kernels.sum(charges, points, alone, {}, context);
  kernels.sum(charges, points, together, gradient, context);
  const double tolerance = kernels.doublePrecision() ? 1e-12 : 3e-6;
  for (std::size_t i = 0; i < points.size(); ++i) {
    // All charges are positive and at least 0.2 away: this bounds the gradient's terms, too.
    const double allowed = tolerance * expected[i];
    if (!(std::abs(alone[i] - expected[i]) <= allowed && std::abs(together[i] - expected[i]) <= allowed &&
          (gradient[i] - slope[i]).norm() <= 5 * allowed)) {
      throw OpenClError("its sums are wrong");
    }
  }
}

}  // namespace

std::shared_ptr<PairDevice> PairDevice::open(const DeviceChoice& choice, const Context& context,
                                             const PairDeviceSettings& settings) {
  if (choice.kind == DeviceKind::cpu) return nullptr;
  std::string name;
  try {
    const OpenClApi api = settings.load ? settings.load() : loadOpenCl();
    const OpenClDevice device = chooseOpenClDevice(api, choice.name);
    name = device.info.name;
    PairKernels kernels(api, device, settings.kernel.empty() ? kPairSumsKernel : settings.kernel,
                        device.info.doublePrecision && settings.allowDouble);
    verify(kernels, context);
    context.log(LogLevel::info, "sums over all pairs run on the OpenCL device " + name + " (" +
                                    device.info.platform + ") in " +
                                    (kernels.doublePrecision() ? "double" : "single") + " precision");
    return std::shared_ptr<PairDevice>(new PairDevice(name, std::move(kernels)));
  } catch (const OpenClError& error) {
    context.log(LogLevel::info,
                "no OpenCL device: sums run on the CPU; " + (name.empty() ? "" : name + ": ") + error.what());
    return nullptr;
  }
}

bool PairDevice::works() const {
  const std::lock_guard<std::mutex> turn(turn_);
  return !failed_;
}

bool PairDevice::sum(const PointCharges& charges, std::span<const Vec3> points, std::span<double> potential,
                     std::span<Vec3> gradient, const Context& context) {
  const std::lock_guard<std::mutex> turn(turn_);
  if (failed_) return false;
  try {
    kernels_.sum(charges, points, potential, gradient, context);
    return true;
  } catch (const OpenClError& error) {
    failed_ = true;
    context.log(LogLevel::info,
                "the OpenCL device " + name_ + " failed: sums run on the CPU from here on; " + error.what());
    return false;
  }
}

DeviceSums::DeviceSums(std::shared_ptr<PairDevice> device, PointCharges places, std::vector<Vec3> targets)
    : device_(std::move(device)), cpu_(std::move(places), std::move(targets)) {}

void DeviceSums::potential(std::span<const double> charge, std::span<double> potential,
                           const Context& context) const {
  if (!device_->sum(cpu_.withCharges(charge), cpu_.targets(), potential, {}, context))
    cpu_.potential(charge, potential, context);
}

}  // namespace polestar::detail
