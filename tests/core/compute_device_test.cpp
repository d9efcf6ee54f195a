#include "polestar/core/compute_device.h"

#include <gtest/gtest.h>

#include "polestar/core/error.h"
#include "support/opencl.h"

namespace polestar {
namespace {

TEST(ComputeDevice, ChoicesAreTheCpuOrOpenClWithAName) {
  EXPECT_EQ(parseDeviceChoice("cpu").kind, DeviceKind::cpu);
  EXPECT_EQ(parseDeviceChoice("opencl").kind, DeviceKind::opencl);
  EXPECT_EQ(parseDeviceChoice("opencl").name, "");
  EXPECT_EQ(parseDeviceChoice("opencl:1").name, "1");
  EXPECT_EQ(parseDeviceChoice("opencl:Some GPU: 2").name, "Some GPU: 2");
  for (const char* wrong : {"", "gpu", "CPU", "cpu:0", "opencl:", "openclx", "opencl 0"}) {
    EXPECT_THROW(parseDeviceChoice(wrong), Error) << wrong;
  }
}

TEST(ComputeDevice, WithoutDevicesTheListSaysWhy) {
  const ComputeDevices list = listComputeDevices();
  EXPECT_EQ(list.devices.empty(), !list.reason.empty()) << list.reason;
}

TEST(ComputeDevice, DevicesAreDescribed) {
  POLESTAR_REQUIRE_OPENCL();
  for (const ComputeDevice& device : testing::openClDevices().devices) {
    EXPECT_NE(device.name, "");
    EXPECT_NE(device.platform, "");
    EXPECT_EQ(device.name.find('\0'), std::string::npos);
    EXPECT_GT(device.memoryBytes, 1U << 20);
    EXPECT_GT(device.computeUnits, 0U);
  }
}

}  // namespace
}  // namespace polestar
