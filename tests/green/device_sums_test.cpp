#include "polestar/green/detail/device_sums.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "polestar/core/error.h"
#include "polestar/green/detail/pair_sums_kernel.h"
#include "support/opencl.h"

namespace polestar::detail {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

const DeviceChoice kOpenCl{DeviceKind::opencl, ""};

/// Charges of both signs on the unit sphere.
PointCharges chargesOnSphere(std::size_t count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  PointCharges charges;
  for (std::size_t j = 0; j < count; ++j) {
    const Vec3 p = Vec3(normal(random), normal(random), normal(random)).normalized();
    charges.x.push_back(p[0]);
    charges.y.push_back(p[1]);
    charges.z.push_back(p[2]);
    charges.charge.push_back(normal(random));
  }
  charges.squaredSoftening = 1e-16;
  return charges;
}

/// Points of the unit ball; every fifth lies on a charge, every fifth 1e-5 beside one.
std::vector<Vec3> pointsAround(const PointCharges& charges, std::size_t count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    Vec3 p(uniform(random), uniform(random), uniform(random));
    if (i % 5 > 2 && charges.size() > 0) {
      const std::size_t j = i % charges.size();
      p = Vec3(charges.x[j], charges.y[j], charges.z[j]) + (i % 5 == 3 ? 0 : 1e-5) * p.normalized();
    }
    points.push_back(p);
  }
  return points;
}

struct Sums {
  explicit Sums(std::size_t count) : potential(count, 7), gradient(count, Vec3(7, 7, 7)) {}
  std::vector<double> potential;
  std::vector<Vec3> gradient;
};

/// Largest errors against long doubles, as shares of the sums of the terms' magnitudes.
struct Errors {
  double potential = 0, gradient = 0;
};

Errors errorsOf(const Sums& sums, const PointCharges& q, const std::vector<Vec3>& points) {
  Errors errors;
  for (std::size_t i = 0; i < points.size(); ++i) {
    long double sum = 0, scale = 0, slopeScale = 0, slope[3] = {0, 0, 0};
    for (std::size_t j = 0; j < q.size(); ++j) {
      const long double d[3] = {points[i][0] - static_cast<long double>(q.x[j]),
                                points[i][1] - static_cast<long double>(q.y[j]),
                                points[i][2] - static_cast<long double>(q.z[j])};
      const long double r = sqrtl(q.squaredSoftening + d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      sum += q.charge[j] / r;
      scale += std::abs(q.charge[j]) / r;
      slopeScale += std::abs(q.charge[j]) / (r * r);
      for (int k = 0; k < 3; ++k) slope[k] -= q.charge[j] * d[k] / (r * r * r);
    }
    errors.potential =
        std::max(errors.potential, static_cast<double>(std::abs(sums.potential[i] - sum) / scale));
    for (int k = 0; k < 3; ++k) {
      errors.gradient = std::max(errors.gradient,
                                 static_cast<double>(std::abs(sums.gradient[i][k] - slope[k]) / slopeScale));
    }
  }
  return errors;
}

/// A context that keeps what is logged.
class LogKept : public ::testing::Test {
 protected:
  LogKept() {
    context_.onLog = [this](LogLevel level, std::string_view line) {
      EXPECT_EQ(level, LogLevel::info);
      log_.emplace_back(line);
    };
  }
  Context context_;
  std::vector<std::string> log_;
};

class DeviceSumsTest : public LogKept {
 protected:
  void SetUp() override { POLESTAR_REQUIRE_OPENCL(); }

  std::shared_ptr<PairDevice> open(const PairDeviceSettings& settings = {}) {
    return PairDevice::open(kOpenCl, context_, settings);
  }

  Sums sumsOn(PairDevice& device, const PointCharges& charges, const std::vector<Vec3>& points) {
    Sums sums(points.size());
    EXPECT_TRUE(device.sum(charges, points, sums.potential, sums.gradient, context_));
    std::vector<double> alone(points.size(), 7);
    EXPECT_TRUE(device.sum(charges, points, alone, {}, context_));
    EXPECT_EQ(alone, sums.potential);
    return sums;
  }
};

constexpr std::size_t kPointCounts[] = {1, 63, 64, 65, 700};     // around groups
constexpr std::size_t kChargeCounts[] = {1, 63, 64, 65, 20001};  // around blocks

TEST_F(DeviceSumsTest, DoublesAgreeWithLongDoubles) {
  const auto device = open();
  ASSERT_TRUE(device);
  if (!device->doublePrecision()) GTEST_SKIP() << device->name() << " has no doubles";
  EXPECT_THAT(log_, ElementsAre(AllOf(HasSubstr(device->name()), HasSubstr("double precision"))));
  for (const std::size_t chargeCount : kChargeCounts) {
    const PointCharges charges = chargesOnSphere(chargeCount);
    for (const std::size_t pointCount : kPointCounts) {
      const std::vector<Vec3> points = pointsAround(charges, pointCount);
      const Errors errors = errorsOf(sumsOn(*device, charges, points), charges, points);
      EXPECT_LT(errors.potential, 1e-14) << chargeCount << " charges, " << pointCount << " points";
      EXPECT_LT(errors.gradient, 1e-14) << chargeCount << " charges, " << pointCount << " points";
    }
  }
}

TEST_F(DeviceSumsTest, SinglePrecisionKeepsSixDigits) {
  const auto device = open({.allowDouble = false});
  ASSERT_TRUE(device);
  EXPECT_FALSE(device->doublePrecision());
  EXPECT_THAT(log_, ElementsAre(HasSubstr("single precision")));
  for (const std::size_t chargeCount : {1U, 65U, 20000U}) {
    const PointCharges charges = chargesOnSphere(chargeCount);
    const std::vector<Vec3> points = pointsAround(charges, 130);
    const Errors errors = errorsOf(sumsOn(*device, charges, points), charges, points);
    EXPECT_LT(errors.potential, 1e-6) << chargeCount << " charges";
    EXPECT_LT(errors.gradient, 1e-6) << chargeCount << " charges";
  }
}

// What single precision would be without the coordinates' second parts: the points beside charges tell.
TEST_F(DeviceSumsTest, SinglePrecisionNeedsBothPartsOfCoordinates) {
  std::string kernel = kPairSumsKernel;
  for (const std::string part : {" + (xLow - low.x)", " + (yLow - low.y)", " + (zLow - low.z)"}) {
    const std::size_t at = kernel.find(part);
    ASSERT_NE(at, std::string::npos);
    kernel.erase(at, part.size());
  }
  const auto device = open({.kernel = kernel, .allowDouble = false});
  ASSERT_TRUE(device);
  const PointCharges charges = chargesOnSphere(65);
  const std::vector<Vec3> points = pointsAround(charges, 130);
  EXPECT_GT(errorsOf(sumsOn(*device, charges, points), charges, points).potential, 1e-5);
}

TEST_F(DeviceSumsTest, ASumDoesNotDependOnHowTheWorkIsCut) {
  const auto device = open();
  ASSERT_TRUE(device);
  // Several launches of charges, and several slices of targets.
  const struct { std::size_t charges, points; } cuts[] = {{150001, 1000}, {65, 300001}};
  for (const auto& cut : cuts) {
    const PointCharges charges = chargesOnSphere(cut.charges);
    const std::vector<Vec3> points = pointsAround(charges, cut.points);
    const Sums together = sumsOn(*device, charges, points);
    for (const std::size_t i : {std::size_t{0}, std::size_t{333}, cut.points - 1}) {
      const Sums alone = sumsOn(*device, charges, {points[i]});
      EXPECT_EQ(alone.potential[0], together.potential[i]);
      EXPECT_EQ(alone.gradient[0], together.gradient[i]);
    }
  }
}

TEST_F(DeviceSumsTest, NoChargesGiveZeroAndNoTargetsNothing) {
  const auto device = open();
  ASSERT_TRUE(device);
  const Sums zero = sumsOn(*device, {}, pointsAround({}, 3));
  EXPECT_THAT(zero.potential, ElementsAre(0, 0, 0));
  EXPECT_EQ(zero.gradient[2], Vec3::Zero());
  sumsOn(*device, chargesOnSphere(10), {});
  sumsOn(*device, {}, {});
}

TEST_F(DeviceSumsTest, ThreadsTakeTurnsAndGetTheSameBytes) {
  const auto device = open();
  ASSERT_TRUE(device);
  const PointCharges charges = chargesOnSphere(2000);
  const std::vector<Vec3> points = pointsAround(charges, 900);
  const Sums expected = sumsOn(*device, charges, points);
  std::vector<Sums> results(8, Sums(points.size()));
  std::vector<std::thread> threads;
  threads.reserve(results.size());
  for (Sums& sums : results) {
    threads.emplace_back(
        [&] { EXPECT_TRUE(device->sum(charges, points, sums.potential, sums.gradient, context_)); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Sums& sums : results) {
    EXPECT_EQ(sums.potential, expected.potential);
    EXPECT_EQ(sums.gradient, expected.gradient);
  }
}

/// The true functions, for those that tests put in their place, and a countdown of calls.
OpenClApi trueApi;
std::atomic<int> callsLeft;

// The user interrupts after the third launch of many.
Context* interrupted;
std::chrono::steady_clock::time_point interruptedAt;

TEST_F(DeviceSumsTest, CancellingStopsWithinASecondAndTheDeviceGoesOn) {
  callsLeft = 1 << 20;
  interrupted = &context_;
  const auto device = open({.load = [] {
    OpenClApi api = trueApi = loadOpenCl();
    api.flush = [](cl_command_queue queue) {
      if (--callsLeft == 0) {
        interruptedAt = std::chrono::steady_clock::now();
        interrupted->cancel();
      }
      return trueApi.flush(queue);
    };
    return api;
  }});
  ASSERT_TRUE(device);
  const PointCharges charges = chargesOnSphere(100000);
  const std::vector<Vec3> points = pointsAround(charges, 50000);
  Sums sums(points.size());
  callsLeft = 3;
  EXPECT_THROW((void)device->sum(charges, points, sums.potential, sums.gradient, context_), Error);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - interruptedAt).count(), 1);
  EXPECT_EQ(callsLeft, 0) << "no launch after it";
  const std::span<double> one = std::span(sums.potential).first(1);
  EXPECT_TRUE(device->sum(charges, std::span(points).first(1), one, {}, Context::quiet()));
}

TEST_F(DeviceSumsTest, DevicesAreChosenByNumberOrName) {
  const std::string name = testing::openClDevices().devices[0].name;
  std::string loud = name.substr(1);
  std::transform(loud.begin(), loud.end(), loud.begin(), [](unsigned char c) { return std::toupper(c); });
  for (const std::string& choice : {std::string("0"), name, loud}) {
    const auto device = PairDevice::open({DeviceKind::opencl, choice}, context_);
    ASSERT_TRUE(device) << choice;
    EXPECT_EQ(device->name(), name);
  }
  log_.clear();
  EXPECT_FALSE(PairDevice::open({DeviceKind::opencl, "no such thing"}, context_));
  EXPECT_THAT(log_, ElementsAre(AllOf(StartsWith("no OpenCL device: sums run on the CPU"),
                                      HasSubstr("no such thing"), HasSubstr(name))));
}

// What a caller sees of a device that does not work.

class DeviceFailures : public LogKept {
 protected:
  Sums onCpu() {
    Sums sums(points_.size());
    DirectChargeField(charges_).evaluate(points_, sums.potential, sums.gradient, context_);
    DirectSums(charges_, points_).potential(charges_.charge, sums.potential, context_);
    return sums;
  }

  const PointCharges charges_ = chargesOnSphere(10000);
  const std::vector<Vec3> points_ = pointsAround(charges_, 600);
};

TEST_F(DeviceFailures, TheCpuIsNoDevice) {
  EXPECT_FALSE(PairDevice::open({}, context_));
  EXPECT_THAT(log_, IsEmpty());
}

TEST_F(DeviceFailures, WithoutTheLibraryThereIsNone) {
  EXPECT_FALSE(
      PairDevice::open(kOpenCl, context_, {.load = [] { return loadOpenCl("libNoSuchOpenCL.so.1"); }}));
  EXPECT_THAT(log_, ElementsAre(AllOf(StartsWith("no OpenCL device: sums run on the CPU"),
                                      HasSubstr("libNoSuchOpenCL.so.1"))));
}

TEST_F(DeviceFailures, AnotherLibraryIsNotTakenForOpenCl) {
  EXPECT_FALSE(PairDevice::open(kOpenCl, context_, {.load = [] { return loadOpenCl("libc.so.6"); }}));
  EXPECT_THAT(log_, ElementsAre(HasSubstr("lacks clGetPlatformIDs")));
}

TEST_F(DeviceFailures, WithoutDriversThereIsNone) {
  POLESTAR_REQUIRE_OPENCL();
  EXPECT_FALSE(PairDevice::open(kOpenCl, context_, {.load = [] {
                                  OpenClApi api = loadOpenCl();
                                  api.getPlatformIds = [](cl_uint, cl_platform_id*, cl_uint*) -> cl_int {
                                    return -1001;
                                  };
                                  return api;
                                }}));
  EXPECT_THAT(log_, ElementsAre(HasSubstr("no driver is installed")));
}

TEST_F(DeviceFailures, KernelsThatDoNotCompileAreNoDevice) {
  POLESTAR_REQUIRE_OPENCL();
  EXPECT_FALSE(PairDevice::open(kOpenCl, context_, {.kernel = "this is no OpenCL C"}));
  EXPECT_THAT(log_, ElementsAre(AllOf(StartsWith("no OpenCL device: sums run on the CPU"),
                                      HasSubstr("the kernel does not compile"))));
}

TEST_F(DeviceFailures, WrongSumsAreNoDevice) {
  POLESTAR_REQUIRE_OPENCL();
  const std::string right = kPairSumsKernel;
  const struct {
    const char *what, *by;
  } mistakes[] = {{"rsqrt(", "sqrt("},
                  {"gy -= slope", "gy += slope"},
                  // Reading what memory holds before the first launch would be wrong by chance only.
                  {"sum[k] = dropped[k] = 0", "sum[k] = dropped[k] = 1"},
                  {"min(block + BLOCK, end)", "block + BLOCK - 1"}};
  for (const auto& mistake : mistakes) {
    std::string wrong = right;
    ASSERT_NE(wrong.find(mistake.what), std::string::npos) << mistake.what;
    wrong.replace(wrong.find(mistake.what), std::string(mistake.what).size(), mistake.by);
    log_.clear();
    EXPECT_FALSE(PairDevice::open(kOpenCl, context_, {.kernel = wrong}));
    EXPECT_THAT(log_, ElementsAre(HasSubstr("its sums are wrong"))) << mistake.by;
  }
}

/// Makes a function of the table fail after callsLeft more calls.
template <auto Member, class Function>
struct Breakable;
template <auto Member, class... Arguments>
struct Breakable<Member, cl_int (*)(Arguments...)> {
  static cl_int call(Arguments... arguments) {
    return callsLeft-- > 0 ? (trueApi.*Member)(arguments...) : CL_OUT_OF_RESOURCES;
  }
};

template <auto Member>
void breakFunction(OpenClApi& api) {
  api.*Member = Breakable<Member, std::remove_reference_t<decltype(api.*Member)>>::call;
}

void breakAllocation(OpenClApi& api) {
  api.createBuffer = [](cl_context context, cl_mem_flags use, std::size_t size, void* host, cl_int* code) {
    if (callsLeft-- > 0) return trueApi.createBuffer(context, use, size, host, code);
    *code = CL_MEM_OBJECT_ALLOCATION_FAILURE;
    return cl_mem{};
  };
}

TEST_F(DeviceFailures, WhateverFailsLaterTheSumsAreTheCpusAndItIsSaidOnce) {
  POLESTAR_REQUIRE_OPENCL();
  const Sums expected = onCpu();
  const std::initializer_list<void (*)(OpenClApi&)> ways{breakAllocation,
                                                         breakFunction<&OpenClApi::setKernelArg>,
                                                         breakFunction<&OpenClApi::enqueueWriteBuffer>,
                                                         breakFunction<&OpenClApi::enqueueNDRangeKernel>,
                                                         breakFunction<&OpenClApi::flush>,
                                                         breakFunction<&OpenClApi::waitForEvents>,
                                                         breakFunction<&OpenClApi::enqueueReadBuffer>};
  int count = 0;
  for (const auto& way : ways) {
    SCOPED_TRACE(count++);
    callsLeft = 1 << 20;
    const auto device = PairDevice::open(kOpenCl, context_, {.load = [&] {
                                           OpenClApi api = trueApi = loadOpenCl();
                                           way(api);
                                           return api;
                                         }});
    ASSERT_TRUE(device);
    const DeviceSums sums(device, charges_, points_);
    log_.clear();
    callsLeft = 0;
    std::vector<double> potential(points_.size());
    for (int repeat = 0; repeat < 2; ++repeat) {
      sums.potential(charges_.charge, potential, context_);
      EXPECT_EQ(potential, expected.potential);
    }
    callsLeft = 1 << 20;  // a device that failed once is not believed again
    sums.potential(charges_.charge, potential, context_);
    EXPECT_EQ(potential, expected.potential);
    EXPECT_EQ(callsLeft, 1 << 20);
    EXPECT_THAT(log_, ElementsAre(AllOf(HasSubstr(device->name() + " failed: sums run on the CPU"),
                                        HasSubstr("out of"))));
  }
}

TEST_F(DeviceFailures, LostBetweenTwoLaunchesNothingOfItsSumsIsKept) {
  POLESTAR_REQUIRE_OPENCL();
  callsLeft = 1 << 20;
  const auto device = PairDevice::open(kOpenCl, context_, {.load = [] {
                                         OpenClApi api = trueApi = loadOpenCl();
                                         breakFunction<&OpenClApi::enqueueNDRangeKernel>(api);
                                         return api;
                                       }});
  ASSERT_TRUE(device);
  const PointCharges charges = chargesOnSphere(300000);  // 600 points: three launches
  std::vector<double> potential(points_.size()), expected(points_.size());
  callsLeft = 2;
  DeviceSums(device, charges, points_).potential(charges.charge, potential, context_);
  EXPECT_LT(callsLeft, 0);
  DirectSums(charges, points_).potential(charges.charge, expected, context_);
  EXPECT_EQ(potential, expected);
}

}  // namespace
}  // namespace polestar::detail
