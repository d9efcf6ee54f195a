#pragma once
// OpenCL without linking to it: its functions are looked up in libOpenCL.so.1 when they are wanted, its
// objects are released by their owners, and its error codes become messages.

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "polestar/core/compute_device.h"

namespace polestar::detail {

/// Never leaves the library: whoever uses a device catches it and goes on without.
class OpenClError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Plain pointers, so that a test can replace one by a function that fails.
struct OpenClApi {
  decltype(&::clGetPlatformIDs) getPlatformIds = nullptr;
  decltype(&::clGetPlatformInfo) getPlatformInfo = nullptr;
  decltype(&::clGetDeviceIDs) getDeviceIds = nullptr;
  decltype(&::clGetDeviceInfo) getDeviceInfo = nullptr;
  decltype(&::clCreateContext) createContext = nullptr;
  decltype(&::clReleaseContext) releaseContext = nullptr;
  decltype(&::clCreateCommandQueue) createCommandQueue = nullptr;
  decltype(&::clReleaseCommandQueue) releaseCommandQueue = nullptr;
  decltype(&::clCreateProgramWithSource) createProgramWithSource = nullptr;
  decltype(&::clBuildProgram) buildProgram = nullptr;
  decltype(&::clGetProgramBuildInfo) getProgramBuildInfo = nullptr;
  decltype(&::clReleaseProgram) releaseProgram = nullptr;
  decltype(&::clCreateKernel) createKernel = nullptr;
  decltype(&::clSetKernelArg) setKernelArg = nullptr;
  decltype(&::clReleaseKernel) releaseKernel = nullptr;
  decltype(&::clCreateBuffer) createBuffer = nullptr;
  decltype(&::clReleaseMemObject) releaseMemObject = nullptr;
  decltype(&::clEnqueueWriteBuffer) enqueueWriteBuffer = nullptr;
  decltype(&::clEnqueueReadBuffer) enqueueReadBuffer = nullptr;
  decltype(&::clEnqueueNDRangeKernel) enqueueNDRangeKernel = nullptr;
  decltype(&::clWaitForEvents) waitForEvents = nullptr;
  decltype(&::clReleaseEvent) releaseEvent = nullptr;
  decltype(&::clFlush) flush = nullptr;
  decltype(&::clFinish) finish = nullptr;
};

/// The library stays loaded until the program ends: drivers keep threads and handlers of their own.
/// @throws OpenClError when `library` or one of its functions is not there.
OpenClApi loadOpenCl(const char* library = "libOpenCL.so.1");

/// @throws OpenClError "`call`: out of device memory (-4)" unless `code` is CL_SUCCESS.
void checkOpenCl(cl_int code, const char* call);

/// Owner of an OpenCL object; `release` is the function of the table that gives it back.
template <class Object>
using OpenClOwner = std::unique_ptr<std::remove_pointer_t<Object>, cl_int (*)(Object)>;

struct OpenClDevice {
  cl_platform_id platform;
  cl_device_id id;
  ComputeDevice info;
};

/// All devices of all platforms. @throws OpenClError when there is none.
std::vector<OpenClDevice> findOpenClDevices(const OpenClApi& api);

/// The one that `name` means; see DeviceChoice::name. @throws OpenClError that lists what there is.
OpenClDevice chooseOpenClDevice(const OpenClApi& api, const std::string& name);

}  // namespace polestar::detail
