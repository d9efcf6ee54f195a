#include "exact_solid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "support/exact_green.h"

namespace polestar::bench {
namespace {

template <class Exact>
ExactSolid solidOf(const std::string& name, const Exact& exact, const Box& box,
                   const std::function<bool(const Vec3&)>& inside,
                   const std::function<TriMesh(int)>& surface) {
  return {.name = name,
          .pole = exact.pole,
          .box = box,
          .harmonicRadius = exact.harmonicRadius(),
          .inside = inside,
          .green = [exact](const Vec3& x) { return exact.green(x); },
          .surface = surface};
}

/// The frequency of a mesh of factor * frequency^2 + 2 vertices.
int frequencyFor(int vertices, int factor) {
  return std::max(1, static_cast<int>(std::lround(std::sqrt((vertices - 2.0) / factor))));
}

/// Additive recurrence with the roots of x^4 = x + 1: evenly spread in three dimensions, without a generator.
Vec3 quasiRandom(int i) {
  constexpr double kRoot = 1.2207440846057596;
  Vec3 u;
  double step = 1;
  for (int k = 0; k < 3; ++k) {
    step /= kRoot;
    u[k] = 0.5 + i * step;
    u[k] -= std::floor(u[k]);
  }
  return u;
}

constexpr double kShallowest = 0.004, kNear = 0.04;  // shares of the way from the surface to the pole

}  // namespace

const std::vector<ExactSolid>& exactSolids() {
  static const std::vector<ExactSolid> solids = {
      solidOf(
          "ball", testing::BallGreen{Vec3(0.3, 0.2, -0.1)}, {Vec3(-1, -1, -1), Vec3(1, 1, 1)},
          [](const Vec3& x) { return x.squaredNorm() < 1; },
          [](int vertices) { return geodesicSphere(frequencyFor(vertices, 10)); }),
      solidOf(
          "half ball", testing::HalfBallGreen{Vec3(0.1, 0, 0.4)}, {Vec3(-1, -1, 0), Vec3(1, 1, 1)},
          [](const Vec3& x) { return x[2] > 0 && x.squaredNorm() < 1; },
          [](int vertices) { return halfBall(frequencyFor(vertices, 6)); }),
      solidOf(
          "cube", testing::CubeGreen{Vec3(0.2, 0.1, -0.15)}, {Vec3(-1, -1, -1), Vec3(1, 1, 1)},
          [](const Vec3& x) { return x.cwiseAbs().maxCoeff() < 1; },
          [](int vertices) { return cube(frequencyFor(vertices, 6)); })};
  return solids;
}

const ExactSolid& exactSolid(const std::string& name) {
  for (const ExactSolid& solid : exactSolids()) {
    if (solid.name == name) return solid;
  }
  throw std::out_of_range("no exact reference for " + name);
}

Vec3 crossing(const std::function<bool(const Vec3&)>& inside, Vec3 in, Vec3 out) {
  constexpr int kHalvings = 52;
  for (int i = 0; i < kHalvings; ++i) {
    const Vec3 middle = 0.5 * (in + out);
    (inside(middle) ? in : out) = middle;
  }
  return 0.5 * (in + out);
}

std::vector<Vec3> probes(const ExactSolid& solid, int count) {
  std::vector<Vec3> points;
  auto exit = [&](const Vec3& direction) {
    return crossing(solid.inside, solid.pole, solid.pole + 2 * solid.box.diagonal() * direction);
  };
  const auto wanted = static_cast<std::size_t>(count), fromVolume = wanted - wanted / 4;
  for (int i = 0; points.size() < fromVolume; ++i) {
    const Vec3 x = solid.box.min + quasiRandom(i).cwiseProduct(solid.box.extent());
    if (!solid.inside(x)) continue;
    const Vec3 way = x - solid.pole, whole = exit(way.normalized()) - solid.pole;
    if (way.norm() <= (1 - kShallowest) * whole.norm()) points.push_back(x);
  }
  for (int i = 0; points.size() < wanted; ++i) {
    const Vec3 u = quasiRandom(i);
    const double z = 1 - 2 * u[0], angle = 2 * std::numbers::pi * u[1], s = std::sqrt(1 - z * z);
    const Vec3 whole = exit(Vec3(s * std::cos(angle), s * std::sin(angle), z)) - solid.pole;
    points.push_back(solid.pole + (1 - kShallowest * std::pow(kNear / kShallowest, u[2])) * whole);
  }
  return points;
}

}  // namespace polestar::bench
