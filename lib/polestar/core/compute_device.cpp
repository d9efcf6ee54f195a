#include "polestar/core/compute_device.h"

#include "polestar/core/detail/opencl.h"
#include "polestar/core/error.h"

namespace polestar {

DeviceChoice parseDeviceChoice(std::string_view text) {
  constexpr std::string_view kOpenCl = "opencl";
  if (text == "cpu") return {};
  if (text == kOpenCl) return {DeviceKind::opencl, ""};
  if (text.starts_with("opencl:") && text.size() > kOpenCl.size() + 1)
    return {DeviceKind::opencl, std::string(text.substr(kOpenCl.size() + 1))};
  throw Error(Errc::usage,
              "a device is cpu, opencl, or opencl:NAME with its number or a part of its name; found \"" +
                  std::string(text) + "\"");
}

ComputeDevices listComputeDevices() {
  ComputeDevices list;
  try {
    for (const detail::OpenClDevice& device : detail::findOpenClDevices(detail::loadOpenCl()))
      list.devices.push_back(device.info);
  } catch (const detail::OpenClError& error) {
    list.devices.clear();
    list.reason = std::string(error.what()) +
                  "; install ocl-icd-libopencl1 and a driver, such as that of the GPU or pocl-opencl-icd";
  }
  return list;
}

}  // namespace polestar
