#pragma once
// Where sums over all pairs run: on this machine's processor, or on a device that OpenCL offers. OpenCL is
// looked for when the program runs; nothing here needs it to be installed.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace polestar {

enum class DeviceKind { cpu, opencl };

/// Which device the caller wants. A choice, not a promise: what is absent or fails is replaced by the CPU,
/// and the Context's log says so.
struct DeviceChoice {
  DeviceKind kind = DeviceKind::cpu;
  /// Of an OpenCL device: its place in listComputeDevices() ("0", "1" ...) or a part of its own or its
  /// platform's name, in any case. Empty: the first GPU, else the first device.
  std::string name;
};

/// "cpu", "opencl", or "opencl:" and DeviceChoice::name.
/// @throws Error{Errc::usage}
DeviceChoice parseDeviceChoice(std::string_view text);

struct ComputeDevice {
  std::string platform, name;
  bool gpu = false;
  bool doublePrecision = false;  ///< cl_khr_fp64; without it sums are good to 1e-5 rather than 1e-12
  std::uint64_t memoryBytes = 0;
  std::uint32_t computeUnits = 0;
};

struct ComputeDevices {
  std::vector<ComputeDevice> devices;
  std::string reason;  ///< when there is none: why, and what to install
};

/// What OpenCL offers, in a fixed order.
ComputeDevices listComputeDevices();

}  // namespace polestar
