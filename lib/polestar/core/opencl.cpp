#include "polestar/core/detail/opencl.h"

#include <dlfcn.h>

#include <algorithm>
#include <cctype>
#include <charconv>

namespace polestar::detail {
namespace {

template <class Function>
void find(void* library, const char* name, Function& function) {
  void* const symbol = dlsym(library, name);
  if (!symbol) throw OpenClError(std::string("the OpenCL library lacks ") + name);
  function = reinterpret_cast<Function>(symbol);
}

const char* describe(cl_int code) {
  switch (code) {
    case CL_DEVICE_NOT_FOUND:
      return "no device";
    case CL_DEVICE_NOT_AVAILABLE:
      return "the device is not available";
    case CL_COMPILER_NOT_AVAILABLE:
      return "the driver has no compiler";
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
      return "out of device memory";
    case CL_OUT_OF_RESOURCES:
      return "out of resources";
    case CL_OUT_OF_HOST_MEMORY:
      return "out of host memory";
    case CL_BUILD_PROGRAM_FAILURE:
      return "the kernel does not compile";
    case CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST:
      return "a kernel was aborted";
    case CL_INVALID_BUFFER_SIZE:
      return "the buffer is larger than the device allows";
    case CL_INVALID_WORK_GROUP_SIZE:
      return "the work-group is larger than the device allows";
    case -1001:  // CL_PLATFORM_NOT_FOUND_KHR
      return "no driver is installed";
    default:
      return "failed";
  }
}

/// Strings of clGetPlatformInfo and clGetDeviceInfo.
template <class Get>
std::string text(Get&& get) {
  std::size_t size = 0;
  get(0, nullptr, &size);
  std::string value(size, '\0');
  get(size, value.data(), nullptr);
  while (!value.empty() && (value.back() == '\0' || value.back() == ' ')) value.pop_back();
  return value;
}

template <class Value>
Value number(const OpenClApi& api, cl_device_id id, cl_device_info what) {
  Value value{};
  checkOpenCl(api.getDeviceInfo(id, what, sizeof value, &value, nullptr), "clGetDeviceInfo");
  return value;
}

OpenClDevice describeDevice(const OpenClApi& api, cl_platform_id platform, cl_device_id id) {
  const auto ofDevice = [&](cl_device_info what) {
    return text([&](std::size_t size, void* value, std::size_t* needed) {
      checkOpenCl(api.getDeviceInfo(id, what, size, value, needed), "clGetDeviceInfo");
    });
  };
  OpenClDevice device{platform, id, {}};
  device.info.platform = text([&](std::size_t size, void* value, std::size_t* needed) {
    checkOpenCl(api.getPlatformInfo(platform, CL_PLATFORM_NAME, size, value, needed), "clGetPlatformInfo");
  });
  device.info.name = ofDevice(CL_DEVICE_NAME);
  device.info.gpu = (number<cl_device_type>(api, id, CL_DEVICE_TYPE) & CL_DEVICE_TYPE_GPU) != 0;
  device.info.doublePrecision = ofDevice(CL_DEVICE_EXTENSIONS).find("cl_khr_fp64") != std::string::npos;
  device.info.memoryBytes = number<cl_ulong>(api, id, CL_DEVICE_GLOBAL_MEM_SIZE);
  device.info.computeUnits = number<cl_uint>(api, id, CL_DEVICE_MAX_COMPUTE_UNITS);
  return device;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

}  // namespace

OpenClApi loadOpenCl(const char* library) {
  void* const handle = dlopen(library, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (!handle) {
    const char* const reason = dlerror();
    throw OpenClError(reason ? reason : std::string("cannot load ") + library);
  }
  OpenClApi api;
  find(handle, "clGetPlatformIDs", api.getPlatformIds);
  find(handle, "clGetPlatformInfo", api.getPlatformInfo);
  find(handle, "clGetDeviceIDs", api.getDeviceIds);
  find(handle, "clGetDeviceInfo", api.getDeviceInfo);
  find(handle, "clCreateContext", api.createContext);
  find(handle, "clReleaseContext", api.releaseContext);
  find(handle, "clCreateCommandQueue", api.createCommandQueue);
  find(handle, "clReleaseCommandQueue", api.releaseCommandQueue);
  find(handle, "clCreateProgramWithSource", api.createProgramWithSource);
  find(handle, "clBuildProgram", api.buildProgram);
  find(handle, "clGetProgramBuildInfo", api.getProgramBuildInfo);
  find(handle, "clReleaseProgram", api.releaseProgram);
  find(handle, "clCreateKernel", api.createKernel);
  find(handle, "clSetKernelArg", api.setKernelArg);
  find(handle, "clReleaseKernel", api.releaseKernel);
  find(handle, "clCreateBuffer", api.createBuffer);
  find(handle, "clReleaseMemObject", api.releaseMemObject);
  find(handle, "clEnqueueWriteBuffer", api.enqueueWriteBuffer);
  find(handle, "clEnqueueReadBuffer", api.enqueueReadBuffer);
  find(handle, "clEnqueueNDRangeKernel", api.enqueueNDRangeKernel);
  find(handle, "clWaitForEvents", api.waitForEvents);
  find(handle, "clReleaseEvent", api.releaseEvent);
  find(handle, "clFlush", api.flush);
  find(handle, "clFinish", api.finish);
  return api;
}

void checkOpenCl(cl_int code, const char* call) {
  if (code == CL_SUCCESS) return;
  throw OpenClError(std::string(call) + ": " + describe(code) + " (" + std::to_string(code) + ")");
}

std::vector<OpenClDevice> findOpenClDevices(const OpenClApi& api) {
  cl_uint count = 0;
  checkOpenCl(api.getPlatformIds(0, nullptr, &count), "clGetPlatformIDs");
  std::vector<cl_platform_id> platforms(count);
  if (count > 0) checkOpenCl(api.getPlatformIds(count, platforms.data(), nullptr), "clGetPlatformIDs");
  std::vector<OpenClDevice> devices;
  for (const cl_platform_id platform : platforms) {
    // A driver without its hardware reports an error here; the other drivers still count.
    if (api.getDeviceIds(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &count) != CL_SUCCESS || count == 0)
      continue;
    std::vector<cl_device_id> ids(count);
    checkOpenCl(api.getDeviceIds(platform, CL_DEVICE_TYPE_ALL, count, ids.data(), nullptr), "clGetDeviceIDs");
    for (const cl_device_id id : ids) devices.push_back(describeDevice(api, platform, id));
  }
  if (devices.empty()) checkOpenCl(CL_DEVICE_NOT_FOUND, "OpenCL");
  return devices;
}

OpenClDevice chooseOpenClDevice(const OpenClApi& api, const std::string& name) {
  const std::vector<OpenClDevice> devices = findOpenClDevices(api);
  if (name.empty()) {
    const auto gpu = std::find_if(devices.begin(), devices.end(), [](auto& d) { return d.info.gpu; });
    return gpu != devices.end() ? *gpu : devices.front();
  }
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
  if (error == std::errc() && end == name.data() + name.size() && index < devices.size())
    return devices[index];
  std::string known;
  for (const OpenClDevice& device : devices) {
    const std::string full = device.info.platform + ", " + device.info.name;
    if (lower(full).find(lower(name)) != std::string::npos) return device;
    known += (known.empty() ? "" : "; ") + full;
  }
  throw OpenClError("none is called \"" + name + "\", there is " + known);
}

}  // namespace polestar::detail
