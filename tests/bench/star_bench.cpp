// The star test on a bumpy body of 20 * 4^levels faces: 20 k, 328 k and 1.3 M.

#include <benchmark/benchmark.h>

#include <cmath>

#include "polestar/mesh/shapes.h"
#include "polestar/star/detail/exact_verdict.h"
#include "polestar/star/detail/inspection.h"
#include "polestar/star/detail/kernel_programs.h"
#include "polestar/star/detail/ray_count.h"

namespace polestar::detail {
namespace {

TriMesh body(const benchmark::State& state) {
  return radialShape(static_cast<int>(state.range(0)), [](const Vec3& w) {
    return 1 + 0.2 * w[2] * w[0] + 0.02 * std::sin(9 * w[0]) * std::sin(11 * w[1]) * std::sin(10 * w[2]);
  });
}

void countFaces(benchmark::State& state, const TriMesh& mesh) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.triangles.size()));
}

// Normals, both programs and the exact verdict: all of the star test but the rays.
void inspectWithoutRays(benchmark::State& state) {
  const TriMesh mesh = body(state);
  StarOptions options;
  options.rays = 0;
  for (auto _ : state) benchmark::DoNotOptimize(inspectMesh(mesh, options, Context::quiet()));
  countFaces(state, mesh);
}

void halfSpaces(benchmark::State& state) {
  const TriMesh mesh = body(state);
  const Frame frame = workingFrame(mesh);
  for (auto _ : state) benchmark::DoNotOptimize(HalfSpaces(mesh, frame));
  countFaces(state, mesh);
}

void largestMarginProgram(benchmark::State& state) {
  const TriMesh mesh = body(state);
  const HalfSpaces halfSpaces(mesh, workingFrame(mesh));
  int scans = 0;
  for (auto _ : state) scans = largestMargin(halfSpaces).scans;
  state.counters["scans"] = scans;
  countFaces(state, mesh);
}

void closestCenterProgram(benchmark::State& state) {
  const TriMesh mesh = body(state);
  const HalfSpaces halfSpaces(mesh, workingFrame(mesh));
  const LargestMargin largest = largestMargin(halfSpaces);
  int scans = 0;
  for (auto _ : state) {
    // A goal outside the kernel, so that there is something to do.
    scans = closestCenter(halfSpaces, Vec3(0.3, 0.3, 0.3), 0.25 * largest.margin, largest.workingSet).scans;
  }
  state.counters["scans"] = scans;
  countFaces(state, mesh);
}

void exactVerdict(benchmark::State& state) {
  const TriMesh mesh = body(state);
  for (auto _ : state) benchmark::DoNotOptimize(judgeCenter(mesh, Vec3::Zero(), 4, Context::quiet()));
  countFaces(state, mesh);
}

void rays(benchmark::State& state) {
  const TriMesh mesh = body(state);
  for (auto _ : state) benchmark::DoNotOptimize(countRayHits(mesh, 10000, Context::quiet()));
  countFaces(state, mesh);
}

BENCHMARK(inspectWithoutRays)->Arg(5)->Arg(7)->Arg(8)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(halfSpaces)->Arg(8)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(largestMarginProgram)->Arg(8)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(closestCenterProgram)->Arg(8)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(exactVerdict)->Arg(8)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(rays)->Arg(5)->Arg(8)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace polestar::detail
