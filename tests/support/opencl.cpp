#include "support/opencl.h"

#include <cstdlib>

namespace polestar::testing {

const ComputeDevices& openClDevices() {
  static const ComputeDevices list = [] {
    setenv("POCL_CACHE_DIR", POLESTAR_POCL_CACHE, 0);
    return listComputeDevices();
  }();
  return list;
}

}  // namespace polestar::testing
