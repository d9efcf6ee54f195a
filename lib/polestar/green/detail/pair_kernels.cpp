#include "polestar/green/detail/pair_kernels.h"

#include <algorithm>
#include <array>
#include <utility>

#include "polestar/green/detail/pair_sums_kernel.h"

namespace polestar::detail {
namespace {

// Targets that are on the device together: enough to fill a large GPU.
constexpr std::size_t kSlice = std::size_t{1} << 18;
// Pairs of a launch: a few milliseconds of a GPU, a tenth of a second of two cores, so that one never waits
// long for a launch to end after a cancellation.
constexpr std::size_t kPairsPerLaunch = std::size_t{1} << 26;

/// Numbers that stand for one coordinate on the device; see kPairSumsKernel.
template <class Real>
constexpr std::size_t kParts = sizeof(Real) < sizeof(double) ? 2 : 1;

/// x = part 0 + part 1.
template <class Real>
Real part(double x, std::size_t which) {
  const Real high = static_cast<Real>(x);
  return which == 0 ? high : static_cast<Real>(x - static_cast<double>(high));
}

template <class Real>
std::vector<Real> packCharges(const PointCharges& charges) {
  std::vector<Real> packed;
  packed.reserve(4 * kParts<Real> * charges.size());
  for (std::size_t j = 0; j < charges.size(); ++j) {
    for (std::size_t p = 0; p < kParts<Real>; ++p) {
      packed.push_back(part<Real>(charges.x[j], p));
      packed.push_back(part<Real>(charges.y[j], p));
      packed.push_back(part<Real>(charges.z[j], p));
      packed.push_back(part<Real>(charges.charge[j], p));
    }
  }
  return packed;
}

/// Planes of `plane` numbers, the last of them padding.
template <class Real>
std::vector<Real> packTargets(std::span<const Vec3> points, std::size_t plane) {
  std::vector<Real> packed(3 * kParts<Real> * plane, Real{0});
  for (std::size_t p = 0; p < kParts<Real>; ++p) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Real* const to = packed.data() + (3 * p + axis) * plane;
      for (std::size_t i = 0; i < points.size(); ++i) to[i] = part<Real>(points[i][axis], p);
    }
  }
  return packed;
}

std::size_t roundedUp(std::size_t count, std::size_t step) { return (count + step - 1) / step * step; }

std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

template <class Value>
void setArgument(const OpenClApi& api, cl_kernel kernel, cl_uint index, const Value& value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  checkOpenCl(api.setKernelArg(kernel, index, bytes.size(), bytes.data()), "clSetKernelArg");
}

// Arguments of the kernel that change between launches.
constexpr cl_uint kBegin = 5, kEnd = 6;

std::size_t vectorWidth(const OpenClApi& api, cl_device_id device, bool doublePrecision) {
  cl_uint width = 0;
  const cl_device_info what =
      doublePrecision ? CL_DEVICE_NATIVE_VECTOR_WIDTH_DOUBLE : CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT;
  checkOpenCl(api.getDeviceInfo(device, what, sizeof width, &width, nullptr), "clGetDeviceInfo");
  for (const std::size_t known : {16U, 8U, 4U, 2U}) {  // of OpenCL's vector types; 3 is padded to 4
    if (width >= known) return known;
  }
  return 1;
}

std::size_t groupSize(const OpenClApi& api, cl_device_id device, std::size_t width) {
  std::size_t largest = 0;
  checkOpenCl(api.getDeviceInfo(device, CL_DEVICE_MAX_WORK_GROUP_SIZE, sizeof largest, &largest, nullptr),
              "clGetDeviceInfo");
  // Vectors mean a CPU, where a group is a loop of one thread; small ones then share the work more evenly.
  return std::min<std::size_t>(largest, width > 1 ? 8 : 64);
}

}  // namespace

PairKernels::PairKernels(OpenClApi api, const OpenClDevice& device, const std::string& source,
                         bool doublePrecision)
    : api_(api),
      doublePrecision_(doublePrecision),
      width_(vectorWidth(api_, device.id, doublePrecision)),
      local_(groupSize(api_, device.id, width_)),
      context_(nullptr, api_.releaseContext),
      queue_(nullptr, api_.releaseCommandQueue),
      potential_{{nullptr, api_.releaseProgram}, {nullptr, api_.releaseKernel}},
      potentialAndGradient_{{nullptr, api_.releaseProgram}, {nullptr, api_.releaseKernel}} {
  const std::array<cl_context_properties, 3> properties{
      CL_CONTEXT_PLATFORM, reinterpret_cast<cl_context_properties>(device.platform), 0};
  cl_int code = CL_SUCCESS;
  context_.reset(api_.createContext(properties.data(), 1, &device.id, nullptr, nullptr, &code));
  checkOpenCl(code, "clCreateContext");
  queue_.reset(api_.createCommandQueue(context_.get(), device.id, 0, &code));
  checkOpenCl(code, "clCreateCommandQueue");
  potential_ = build(device, source, false);
  potentialAndGradient_ = build(device, source, true);
}

PairKernels::Kernel PairKernels::build(const OpenClDevice& device, const std::string& source,
                                       bool gradient) const {
  const std::string real = doublePrecision_ ? "double" : "float";
  const std::string options = "-DREAL=" + real + " -DREAL4=" + real + "4 -DVECTOR=" + real +
                              (width_ > 1 ? std::to_string(width_) : "") +
                              (doublePrecision_ ? "" : " -DSINGLE") + (gradient ? " -DGRADIENT" : "") +
                              " -DBLOCK=" + std::to_string(kPairBlock);
  Kernel built{{nullptr, api_.releaseProgram}, {nullptr, api_.releaseKernel}};
  const char* text = source.c_str();
  cl_int code = CL_SUCCESS;
  built.program.reset(api_.createProgramWithSource(context_.get(), 1, &text, nullptr, &code));
  checkOpenCl(code, "clCreateProgramWithSource");
  code = api_.buildProgram(built.program.get(), 1, &device.id, options.c_str(), nullptr, nullptr);
  if (code != CL_SUCCESS) {
    std::string log(4096, '\0');
    std::size_t size = 0;
    if (api_.getProgramBuildInfo(built.program.get(), device.id, CL_PROGRAM_BUILD_LOG, log.size(), log.data(),
                                 &size) != CL_SUCCESS) {
      size = 0;
    }
    log.resize(size);
    checkOpenCl(code, ("clBuildProgram: " + firstLine(log)).c_str());
  }
  built.kernel.reset(api_.createKernel(built.program.get(), "pairSums", &code));
  checkOpenCl(code, "clCreateKernel");
  return built;
}

OpenClOwner<cl_mem> PairKernels::allocate(cl_mem_flags use, std::size_t bytes) const {
  cl_int code = CL_SUCCESS;
  OpenClOwner<cl_mem> buffer(api_.createBuffer(context_.get(), use, bytes, nullptr, &code),
                             api_.releaseMemObject);
  checkOpenCl(code, "clCreateBuffer");
  return buffer;
}

template <class Real>
OpenClOwner<cl_mem> PairKernels::upload(const std::vector<Real>& values) const {
  OpenClOwner<cl_mem> buffer = allocate(CL_MEM_READ_ONLY, values.size() * sizeof(Real));
  checkOpenCl(api_.enqueueWriteBuffer(queue_.get(), buffer.get(), CL_TRUE, 0, values.size() * sizeof(Real),
                                      values.data(), 0, nullptr, nullptr),
              "clEnqueueWriteBuffer");
  return buffer;
}

void PairKernels::sum(const PointCharges& charges, std::span<const Vec3> points, std::span<double> potential,
                      std::span<Vec3> gradient, const Context& context) const {
  if (charges.size() == 0) {  // no buffer may be empty
    std::fill(potential.begin(), potential.end(), 0.0);
    std::fill(gradient.begin(), gradient.end(), Vec3::Zero());
  } else if (doublePrecision_) {
    sumAs<double>(charges, points, potential, gradient, context);
  } else {
    sumAs<float>(charges, points, potential, gradient, context);
  }
}

template <class Real>
void PairKernels::sumAs(const PointCharges& charges, std::span<const Vec3> points,
                        std::span<double> potential, std::span<Vec3> gradient, const Context& context) const {
  // Whatever ends this early, no kernel goes on with buffers that are gone.
  struct Idle {
    const OpenClApi& api;
    cl_command_queue queue;
    ~Idle() { api.finish(queue); }
  };
  const OpenClOwner<cl_mem> buffer = upload(packCharges<Real>(charges));
  const Idle idle{api_, queue_.get()};
  for (std::size_t begin = 0; begin < points.size(); begin += kSlice) {
    const std::size_t count = std::min(kSlice, points.size() - begin);
    sumSlice<Real>({buffer.get(), charges.size(), charges.squaredSoftening}, points.subspan(begin, count),
                   potential.subspan(begin, count),
                   gradient.empty() ? gradient : gradient.subspan(begin, count), context);
  }
}

template <class Real>
void PairKernels::sumSlice(const Charges& charges, std::span<const Vec3> points, std::span<double> potential,
                           std::span<Vec3> gradient, const Context& context) const {
  const cl_kernel kernel = (gradient.empty() ? potential_ : potentialAndGradient_).kernel.get();
  const std::size_t plane = roundedUp(points.size(), width_ * local_), vectors = plane / width_;
  const std::size_t sums = gradient.empty() ? 1 : 4;
  const OpenClOwner<cl_mem> targets = upload(packTargets<Real>(points, plane));
  std::vector<Real> result(sums * kParts<Real> * plane);
  const OpenClOwner<cl_mem> output = allocate(CL_MEM_READ_WRITE, result.size() * sizeof(Real));
  setArgument(api_, kernel, 0, charges.buffer);
  setArgument(api_, kernel, 1, targets.get());
  setArgument(api_, kernel, 2, output.get());
  setArgument(api_, kernel, 3, static_cast<cl_uint>(vectors));
  setArgument(api_, kernel, 4, static_cast<Real>(charges.squaredSoftening));
  launchAll(kernel, vectors, charges.count, context);
  checkOpenCl(api_.enqueueReadBuffer(queue_.get(), output.get(), CL_TRUE, 0, result.size() * sizeof(Real),
                                     result.data(), 0, nullptr, nullptr),
              "clEnqueueReadBuffer");
  const auto value = [&](std::size_t sum, std::size_t i) {
    double total = 0;
    for (std::size_t p = 0; p < kParts<Real>; ++p) total += result[(sums * p + sum) * plane + i];
    return total;
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    potential[i] = value(0, i);
    if (!gradient.empty()) gradient[i] = Vec3(value(1, i), value(2, i), value(3, i));
  }
}

void PairKernels::launchAll(cl_kernel kernel, std::size_t vectors, std::size_t chargeCount,
                            const Context& context) const {
  const std::size_t perLaunch =
      std::max<std::size_t>(1, kPairsPerLaunch / (vectors * width_) / kPairBlock) * kPairBlock;
  // Two launches are under way, so that the device need not wait for us; the older one is waited for.
  OpenClOwner<cl_event> older(nullptr, api_.releaseEvent);
  const auto wait = [&](const OpenClOwner<cl_event>& launch) {
    const cl_event event = launch.get();
    if (event) checkOpenCl(api_.waitForEvents(1, &event), "clWaitForEvents");
  };
  for (std::size_t begin = 0; begin < chargeCount; begin += perLaunch) {
    context.throwIfCancelled();
    setArgument(api_, kernel, kBegin, static_cast<cl_uint>(begin));
    setArgument(api_, kernel, kEnd, static_cast<cl_uint>(std::min(chargeCount, begin + perLaunch)));
    cl_event event = nullptr;
    checkOpenCl(
        api_.enqueueNDRangeKernel(queue_.get(), kernel, 1, nullptr, &vectors, &local_, 0, nullptr, &event),
        "clEnqueueNDRangeKernel");
    OpenClOwner<cl_event> newer(event, api_.releaseEvent);
    checkOpenCl(api_.flush(queue_.get()), "clFlush");
    wait(older);
    older = std::move(newer);
  }
  wait(older);
}

}  // namespace polestar::detail
