#include "polestar/sphere/sphere_map.h"

#include <gtest/gtest.h>
#include <iostream>
#include <chrono>

#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/conformal.h"

namespace polestar {
namespace {
TEST(Probe, Shapes) {
  Context ctx;
  ctx.onLog = [](LogLevel, std::string_view m) { std::cout << "   " << m << "\n"; };
  auto run = [&](const char* name, const TriMesh& mesh) {
    auto t0 = std::chrono::steady_clock::now();
    const SphereMap map = detail::conformalMap(mesh, {}, ctx);
    const SphereMap rad = detail::radialMap(mesh);
    std::cout << name << " V " << mesh.vertices.size() << " t "
              << std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count() << " qc " << map.qcMean << " max "
              << map.qcMax << " flips " << map.flips << " radial " << rad.qcMean << "\n";
  };
  run("ico4", icosphere(4));
  for (int l : {3, 4, 5, 6}) run("ellipsoid", transformed(icosphere(l), [](const Vec3& v) { return Vec3(2 * v[0], v[1], .7 * v[2]); }));
  for (int l : {4, 5, 6, 7}) run("star", smoothStar(l));
  run("cube", cube(20));
  run("half", transformed(halfBall(20), [](const Vec3& v) { return Vec3(v - Vec3(0, 0, .4)); }));
}
}  // namespace
}  // namespace polestar
