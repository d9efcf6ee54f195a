// The near field of the layer: points just off a bumpy body, candidates as a box of a fast method would list
// them.

#include <benchmark/benchmark.h>

#include <cmath>

#include "polestar/green/detail/near_field.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

struct Scene {
  TriMesh mesh = radialShape(5, [](const Vec3& w) {
    return 1 + 0.2 * w[2] * w[0] + 0.02 * std::sin(9 * w[0]) * std::sin(11 * w[1]) * std::sin(10 * w[2]);
  });
  NearField field{mesh, 1e-20};
  NearField::Density density = field.density(std::vector<double>(mesh.vertices.size(), 1.0));
  std::vector<Vec3> points;  // in one box
  NearCandidates candidates;
  double nearCount = 0;  // mean over the points

  Scene() {
    const Vec3 center = mesh.vertices[mesh.vertices.size() / 2];
    const double halfBox = field.nearSphere(0).radius / NearField::kNear;
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t t = 0; t < field.triangleCount(); ++t) {
      const NearField::Sphere sphere = field.nearSphere(t);
      const Vec3 outside = ((sphere.center - center).cwiseAbs().array() - halfBox).max(0);
      if (outside.norm() < sphere.radius) triangles.push_back(t);
      if ((sphere.center - center).cwiseAbs().maxCoeff() < halfBox) points.push_back(0.999 * sphere.center);
    }
    candidates.assign(field, triangles);
    std::vector<NearField::Row> rows;
    for (const Vec3& x : points) field.appendRows(x, candidates, rows);
    nearCount = static_cast<double>(rows.size()) / static_cast<double>(points.size());
  }
  // "time_per_near": seconds.
  void report(benchmark::State& state) const {
    const double pairs =
        static_cast<double>(state.iterations()) * static_cast<double>(points.size()) * nearCount;
    state.counters["candidates"] = static_cast<double>(candidates.size());
    state.counters["near"] = nearCount;
    state.counters["time_per_near"] =
        benchmark::Counter(pairs, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  }
};

const Scene& scene() {
  static const Scene instance;
  return instance;
}

void nearPotential(benchmark::State& state) {
  const Scene& s = scene();
  for (auto _ : state) {
    for (const Vec3& x : s.points) benchmark::DoNotOptimize(s.field.potential(x, s.candidates, s.density));
  }
  s.report(state);
}

void nearPotentialAndGradient(benchmark::State& state) {
  const Scene& s = scene();
  for (auto _ : state) {
    double potential = 0;
    Vec3 gradient = Vec3::Zero();
    for (const Vec3& x : s.points)
      s.field.addPotentialAndGradient(x, s.candidates, s.density, potential, gradient);
    benchmark::DoNotOptimize(potential);
    benchmark::DoNotOptimize(gradient);
  }
  s.report(state);
}

void nearRows(benchmark::State& state) {
  const Scene& s = scene();
  std::vector<NearField::Row> rows;
  for (auto _ : state) {
    rows.clear();
    for (const Vec3& x : s.points) s.field.appendRows(x, s.candidates, rows);
    benchmark::DoNotOptimize(rows.data());
  }
  s.report(state);
}

void nearConstruction(benchmark::State& state) {
  const Scene& s = scene();
  for (auto _ : state) benchmark::DoNotOptimize(NearField(s.mesh, 1e-20));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.field.triangleCount()));
}

BENCHMARK(nearPotential)->Unit(benchmark::kMicrosecond);
BENCHMARK(nearPotentialAndGradient)->Unit(benchmark::kMicrosecond);
BENCHMARK(nearRows)->Unit(benchmark::kMicrosecond);
BENCHMARK(nearConstruction)->Unit(benchmark::kMicrosecond)->UseRealTime();

}  // namespace
}  // namespace polestar::detail
