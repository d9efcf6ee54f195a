// The solver with its sums on an OpenCL device, against the same on the CPU.
#include <gtest/gtest.h>

#include "polestar/green/detail/device_sums.h"
#include "polestar/green/detail/layer_field.h"
#include "polestar/mesh/shapes.h"
#include "support/opencl.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::pointsInside;
using testing::starShape;

const DeviceChoice kOpenCl{DeviceKind::opencl, ""};

class DeviceSolver : public ::testing::Test {
 protected:
  void SetUp() override { POLESTAR_REQUIRE_OPENCL(); }

  /// h inside, from a solve on `device`; always evaluated on the CPU.
  std::vector<double> potentials(const std::shared_ptr<detail::PairDevice>& device) const {
    Context& context = Context::quiet();
    const auto surface =
        std::make_shared<const detail::AlignedSurface>(shape_.mesh(), Mat3::Identity(), context);
    const detail::LayerEquation equation(surface, 30, context);
    const detail::LayerSolution solution = equation.solve({}, {.device = device}, context);
    EXPECT_LE(solution.residual, 1e-6);
    std::vector<Vec3> points = pointsInside(shape_, 300);
    for (Vec3& x : points) x = shape_.frame().toInner(x);
    std::vector<double> h(points.size());
    std::vector<Vec3> gradient(points.size());
    detail::LayerField(surface, solution.density, 1e-9, context).evaluate(points, h, gradient);
    return h;
  }

  void expectAgreement(const std::shared_ptr<detail::PairDevice>& device, double tolerance) const {
    ASSERT_TRUE(device);
    const std::vector<double> onDevice = potentials(device), onCpu = potentials(nullptr);
    EXPECT_TRUE(device->works());
    EXPECT_NE(onDevice, onCpu) << "to the last bit: the device was not asked";
    for (std::size_t i = 0; i < onCpu.size(); ++i)
      ASSERT_NEAR(onDevice[i], onCpu[i], tolerance * std::abs(onCpu[i]));
  }

  const StarShape shape_ = starShape(smoothStar(3));
};

TEST_F(DeviceSolver, InDoublePrecisionAgreesWithTheCpu) {
  const auto device = detail::PairDevice::open(kOpenCl, Context::quiet());
  ASSERT_TRUE(device);
  if (!device->doublePrecision()) GTEST_SKIP() << device->name() << " has no doubles";
  expectAgreement(device, 1e-6);
}

TEST_F(DeviceSolver, InSinglePrecisionAgreesToFiveDigits) {
  expectAgreement(detail::PairDevice::open(kOpenCl, Context::quiet(), {.allowDouble = false}), 1e-5);
}

TEST_F(DeviceSolver, GreensFunctionNamesItsDevice) {
  GreenOptions options;
  EXPECT_EQ(solveGreen(shape_, options).record().summary.device, "cpu");
  options.device = kOpenCl;
  EXPECT_EQ(solveGreen(shape_, options).record().summary.device,
            detail::PairDevice::open(kOpenCl, Context::quiet())->name());
  options.device.name = "no such device";
  EXPECT_EQ(solveGreen(shape_, options).record().summary.device, "cpu");
}

}  // namespace
}  // namespace polestar
