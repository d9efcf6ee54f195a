#pragma once
// Tests on an OpenCL device: on Debian pocl-opencl-icd makes one of the CPU.

#include <gtest/gtest.h>

#include "polestar/core/compute_device.h"

namespace polestar::testing {

/// What OpenCL offers. PoCL keeps its compiled kernels in the build folder, unless POCL_CACHE_DIR says
/// otherwise; tools that a test starts inherit that.
const ComputeDevices& openClDevices();

}  // namespace polestar::testing

/// Ends the test as skipped, visibly, when there is no device.
#define POLESTAR_REQUIRE_OPENCL()                                                      \
  if (polestar::testing::openClDevices().devices.empty()) {                            \
    GTEST_SKIP() << "no OpenCL device: " << polestar::testing::openClDevices().reason; \
  }                                                                                    \
  static_assert(true, "")
