// Pictures of a bumpy body of 1.3 M triangles (levels = 8) or 328 k (7), cut open, by a map with a formula:
// rays and light, without the cost of a real map.

#include <benchmark/benchmark.h>

#include <cmath>

#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/render/detail/sampling.h"
#include "polestar/render/detail/solid_scene.h"
#include "polestar/render/mapped_appearance.h"
#include "polestar/render/render_solid.h"
#include "support/formula_map.h"

namespace polestar {
namespace {

double bumpyRadius(const Vec3& w) {
  return 1 + 0.2 * w[2] * w[0] + 0.02 * std::sin(9 * w[0]) * std::sin(11 * w[1]) * std::sin(10 * w[2]);
}

/// 20 * 158^2 = 499,280 triangles.
const TriMesh& bumpyBody() {
  static const TriMesh mesh =
      transformed(geodesicSphere(158), [](const Vec3& w) { return Vec3(bumpyRadius(w) * w); });
  return mesh;
}

/// One thread, camera rays of a 1280 x 960 picture's middle, 16 a pixel: hits alone.
void primaryRays(benchmark::State& state) {
  const detail::SolidScene scene({bumpyBody(), {{{{Vec3(-1, 0, 0), 0.0}}, true, Vec3::Zero()}}}, 0.9);
  detail::RayBundle rays;
  const Vec3f from(5, -2, 1.5f);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      float u[16], v[16];
      detail::squarePoints(detail::pixelSamples(x, y, 16), 0, 16, u, v);
      for (int i = 0; i < 16; ++i) {
        const Vec3f target(0, 0.002f * (static_cast<float>(x - 32) + u[i]),
                           0.002f * (static_cast<float>(y - 32) + v[i]));
        rays.add(from, (target * 8 - from).normalized());
      }
    }
  }
  std::vector<detail::SceneHit> hits(rays.size());
  for (auto _ : state) scene.firstHits(rays, hits);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays.size()));
}

RenderOptions pictureOptions() {
  RenderOptions options;
  options.width = 1920;
  options.height = 1080;
  options.samples = 16;
  options.cuts = {{Vec3::UnitX(), 0}};
  return options;
}

void picture(benchmark::State& state, Shading shading) {
  const auto map = testing::radialMap(bumpyRadius);
  const auto appearance = makeMappedAppearance(map, nullptr, coordinateLook(2.2));
  RenderOptions options = pictureOptions();
  options.shading = shading;
  const SolidRenderer renderer(bumpyBody(), *appearance, options);
  Rendering rendering;
  for (auto _ : state) rendering = renderer.render();
  state.SetItemsProcessed(state.iterations() *
                          static_cast<std::int64_t>(rendering.primaryRays + rendering.lightRays));
  state.counters["primary"] = static_cast<double>(rendering.primaryRays);
  state.counters["light"] = static_cast<double>(rendering.lightRays);
}

void buildScene(benchmark::State& state) {
  const auto map = testing::radialMap(bumpyRadius);
  const auto appearance = makeMappedAppearance(map, nullptr, coordinateLook(2.2));
  for (auto _ : state) {
    const SolidRenderer renderer(bumpyBody(), *appearance, pictureOptions());
    benchmark::DoNotOptimize(&renderer);
  }
}

BENCHMARK(primaryRays)->Unit(benchmark::kMillisecond);
BENCHMARK(buildScene)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(picture, flat, Shading::flat)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(picture, studio, Shading::studio)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace polestar
