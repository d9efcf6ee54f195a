// The conformal sphere map and its parts on a bumpy body of 10 * 4^levels vertices: 10 k, 41 k and 164 k.

#include <benchmark/benchmark.h>

#include <cmath>

#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/conformal.h"
#include "polestar/sphere/detail/dirichlet.h"
#include "polestar/sphere/detail/laplacian.h"

namespace polestar::detail {
namespace {

TriMesh body(const benchmark::State& state) {
  return radialShape(static_cast<int>(state.range(0)), [](const Vec3& w) {
    return (1 + 0.2 * w[2] * w[0] + 0.02 * std::sin(9 * w[0]) * std::sin(11 * w[1]) * std::sin(10 * w[2])) /
           std::hypot(w[0] / 1.6, w[1], w[2] / 0.8);
  });
}

void countVertices(benchmark::State& state, const TriMesh& mesh) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.vertices.size()));
}

void wholeMap(benchmark::State& state) {
  const TriMesh mesh = body(state);
  for (auto _ : state) benchmark::DoNotOptimize(conformalMap(mesh, {}, Context::quiet()));
  countVertices(state, mesh);
}

void intrinsicDelaunay(benchmark::State& state) {
  const TriMesh mesh = body(state);
  for (auto _ : state) benchmark::DoNotOptimize(intrinsicDelaunayLaplacian(mesh));
  countVertices(state, mesh);
}

void factorization(benchmark::State& state) {
  const TriMesh mesh = body(state);
  const Laplacian laplacian = intrinsicDelaunayLaplacian(mesh);
  const std::vector<double> shares = vertexAreaShares(mesh);
  for (auto _ : state) {
    const ShiftedLaplacian factor(laplacian, shares, mesh.vertices);
    benchmark::DoNotOptimize(&factor);
  }
  countVertices(state, mesh);
}

void onePreconditionedStep(benchmark::State& state) {
  const TriMesh mesh = body(state);
  const DirichletEnergy energy(intrinsicDelaunayLaplacian(mesh), vertexAreaShares(mesh), mesh.vertices);
  std::vector<Vec3> gradient(mesh.vertices.size()), step(mesh.vertices.size());
  const std::vector<Vec3> points = radialMap(mesh).directions;
  for (auto _ : state) {
    benchmark::DoNotOptimize(energy.evaluate(points, gradient));
    energy.precondition(gradient, step);
  }
  countVertices(state, mesh);
}

BENCHMARK(wholeMap)->DenseRange(5, 7)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(intrinsicDelaunay)->DenseRange(5, 7)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(factorization)->DenseRange(5, 7)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(onePreconditionedStep)->DenseRange(5, 7)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace polestar::detail
