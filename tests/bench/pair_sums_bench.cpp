// Sums over pairs of charges and points, CPU against an OpenCL device: pairs a second. The device is the one
// of
// --device opencl; POCL_MAX_PTHREAD_COUNT=1 and one thread for the CPU compare cores.

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "polestar/green/detail/device_sums.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kCharges = 30000;

struct Problem {
  PointCharges charges;
  std::vector<Vec3> points;
};

Problem problem(std::size_t points) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Problem made;
  for (std::size_t j = 0; j < kCharges; ++j) {
    const Vec3 p = Vec3(normal(random), normal(random), normal(random)).normalized();
    made.charges.x.push_back(p[0]);
    made.charges.y.push_back(p[1]);
    made.charges.z.push_back(p[2]);
    made.charges.charge.push_back(1);
  }
  for (std::size_t i = 0; i < points; ++i)
    made.points.push_back(0.5 * Vec3(normal(random), normal(random), normal(random)).normalized());
  return made;
}

std::shared_ptr<PairDevice> device(benchmark::State& state, bool allowDouble) {
  auto opened = PairDevice::open({DeviceKind::opencl, ""}, Context::quiet(),
                                 {.load{}, .kernel{}, .allowDouble = allowDouble});
  if (!opened) state.SkipWithError("no OpenCL device");
  return opened;
}

void countPairs(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * state.range(0) * static_cast<std::int64_t>(kCharges));
}

void potentialCpu(benchmark::State& state) {
  const Problem made = problem(static_cast<std::size_t>(state.range(0)));
  const DirectSums sums(made.charges, made.points);
  std::vector<double> potential(made.points.size());
  for (auto _ : state) sums.potential(made.charges.charge, potential, Context::quiet());
  countPairs(state);
}

void gradientCpu(benchmark::State& state) {
  const Problem made = problem(static_cast<std::size_t>(state.range(0)));
  const DirectChargeField field(made.charges);
  std::vector<double> potential(made.points.size());
  std::vector<Vec3> gradient(made.points.size());
  for (auto _ : state) field.evaluate(made.points, potential, gradient, Context::quiet());
  countPairs(state);
}

void onDevice(benchmark::State& state, bool allowDouble, bool withGradient) {
  const auto opened = device(state, allowDouble);
  if (!opened) return;
  const Problem made = problem(static_cast<std::size_t>(state.range(0)));
  std::vector<double> potential(made.points.size());
  std::vector<Vec3> gradient(withGradient ? made.points.size() : 0);
  for (auto _ : state) {
    if (!opened->sum(made.charges, made.points, potential, gradient, Context::quiet()))
      state.SkipWithError("the device failed");
  }
  countPairs(state);
}

void potentialDouble(benchmark::State& state) { onDevice(state, true, false); }
void potentialSingle(benchmark::State& state) { onDevice(state, false, false); }
void gradientDouble(benchmark::State& state) { onDevice(state, true, true); }
void gradientSingle(benchmark::State& state) { onDevice(state, false, true); }

// 16: a step of a field line; 30,000 charges have about 20,000 triangles and as many targets.
BENCHMARK(potentialCpu)
    ->Arg(16)
    ->Arg(128)
    ->Arg(512)
    ->Arg(30000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(potentialDouble)
    ->Arg(16)
    ->Arg(128)
    ->Arg(512)
    ->Arg(30000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(potentialSingle)
    ->Arg(16)
    ->Arg(128)
    ->Arg(512)
    ->Arg(30000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(gradientCpu)->Arg(16)->Arg(128)->Arg(512)->Arg(30000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(gradientDouble)
    ->Arg(16)
    ->Arg(128)
    ->Arg(512)
    ->Arg(30000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(gradientSingle)
    ->Arg(16)
    ->Arg(128)
    ->Arg(512)
    ->Arg(30000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace polestar::detail
