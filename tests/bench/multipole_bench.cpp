// Sums over all pairs: where the fast multipole method overtakes the direct one, and its error by order.
//
//   bench_multipole --benchmark_filter=Sums      time by the number of charges, either way
//   bench_multipole --benchmark_filter=Error     largest error of the potential relative to its largest value
//
// Charges at the edge midpoints of an ellipsoid's triangles, targets at vertices and centroids, as the layer
// has them.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

#include "polestar/green/detail/multipole.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

struct Problem {
  PointCharges charges;
  std::vector<Vec3> targets;
};

Problem ellipsoid(int level) {
  TriMesh mesh = icosphere(level);
  for (Vec3& v : mesh.vertices) v = v.cwiseProduct(Vec3(1, 0.7, 0.45));
  Problem problem;
  problem.targets = mesh.vertices;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    problem.targets.push_back((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3);
    for (int k = 0; k < 3; ++k) {
      const std::int32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      if (a > b) continue;
      const Vec3 middle = 0.5 * (mesh.vertices[a] + mesh.vertices[b]);
      problem.charges.x.push_back(middle[0]);
      problem.charges.y.push_back(middle[1]);
      problem.charges.z.push_back(middle[2]);
      problem.charges.charge.push_back((1 + 0.5 * std::sin(40 * middle[0])) /
                                       static_cast<double>(mesh.triangles.size()));
    }
  }
  problem.charges.squaredSoftening = 1e-18;
  return problem;
}

template <class Sums>
void time(benchmark::State& state, const Problem& problem, const Sums& sums) {
  std::vector<double> potential(problem.targets.size());
  for (auto _ : state) sums.potential(problem.charges.charge, potential, Context::quiet());
  state.counters["charges"] = static_cast<double>(problem.charges.size());
  state.counters["pairs"] =
      static_cast<double>(problem.charges.size()) * static_cast<double>(problem.targets.size());
}

void DirectSumsTime(benchmark::State& state) {
  const Problem problem = ellipsoid(static_cast<int>(state.range(0)));
  time(state, problem, DirectSums(problem.charges, problem.targets));
}
BENCHMARK(DirectSumsTime)->DenseRange(2, 5)->Unit(benchmark::kMillisecond)->UseRealTime();

void MultipoleSumsTime(benchmark::State& state) {
  const Problem problem = ellipsoid(static_cast<int>(state.range(0)));
  time(state, problem, MultipoleSums(problem.charges, problem.targets, static_cast<int>(state.range(1))));
}
BENCHMARK(MultipoleSumsTime)
    ->ArgsProduct({{2, 3, 4, 5, 6}, {7, 13}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void MultipoleError(benchmark::State& state) {
  const Problem problem = ellipsoid(5);
  std::vector<double> exact(problem.targets.size()), fast(exact);
  DirectSums(problem.charges, problem.targets).potential(problem.charges.charge, exact, Context::quiet());
  const MultipoleSums sums(problem.charges, problem.targets, static_cast<int>(state.range(0)));
  for (auto _ : state) sums.potential(problem.charges.charge, fast, Context::quiet());
  double worst = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) worst = std::max(worst, std::abs(fast[i] - exact[i]));
  state.counters["log10 error"] = std::log10(worst / *std::max_element(exact.begin(), exact.end()));
  state.counters["expected"] = std::log10(truncationError(static_cast<int>(state.range(0))));
}
BENCHMARK(MultipoleError)->DenseRange(4, 28, 4)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace polestar::detail
