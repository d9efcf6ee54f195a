#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "polestar/core/detail/parallel.h"
#include "polestar/map/ball_map.h"
#include "polestar/map/detail/core_isotopy.h"
#include "polestar/map/detail/direction_map.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar {
namespace {

constexpr double kTraceTolerance = 1e-8;
const Vec3 kNowhere = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());

}  // namespace

struct TracedBallMap::Data {
  BallMap table;
  FieldLineTracer tracer;
  SphereLocator surface;
  detail::DirectionMap boundaryOf;
  detail::CoreIsotopy isotopy;

  const GreenChart& chart() const { return table.chart(); }
  const Frame& frame() const { return chart().green().shape().frame(); }

  Vec3 forward(const Vec3& x) const {
    if (!x.allFinite()) return kNowhere;
    const double r = x.norm();
    if (r == 0) return Vec3::Zero();
    const auto hit = surface.locate(x);
    if (!hit || r > surface.point(*hit).norm() * (1 + 1e-12)) return kNowhere;

    double green;
    Vec3 gradient;
    const GreenFunction& g = chart().green();
    g.evaluate({&x, 1}, {&green, 1}, {&gradient, 1});
    const double radius = g.ballRadius(green);
    // Inward to two small levels; from there the limit by extrapolation.
    const std::array<double, 2> levels{std::min(0.06, 0.7 * radius), std::min(0.03, 0.35 * radius)};
    const FieldLineTracer::Line line = tracer.trace({&x, 1}, levels).front();
    if (!line.ok) return kNowhere;
    const Vec3 direction =
        limitDirection(line.nodes[0].position, levels[0], line.nodes[1].position, levels[1]);
    const std::optional<Vec3> phi = boundaryOf(direction);
    if (!phi) return kNowhere;
    return table.radius().value(radius) * isotopy.direction(radius, direction, *phi);
  }

  // The table's Jacobian is close to this map's: each correction gains about two digits.
  Vec3 inverse(const Vec3& y) const {
    Vec3 world;
    table.inverse({&y, 1}, {&world, 1});
    for (int i = 0; i < 8; ++i) {
      const Vec3 rest = forward(frame().toInner(world)) - y;
      if (!rest.allFinite() || rest.norm() < 1e-10) break;
      Mat3 jacobian;
      table.jacobian({&world, 1}, {&jacobian, 1});
      const Vec3 next = world - jacobian.fullPivLu().solve(rest);
      const Vec3 nextRest = forward(frame().toInner(next)) - y;
      if (!(nextRest.norm() < rest.norm())) break;
      world = next;
    }
    return world;
  }

  Mat3 jacobian(const Vec3& x) const {
    constexpr double kStep = 1e-4;
    Mat3 derivative;
    for (int k = 0; k < 3; ++k) {
      const Vec3 offset = kStep * Vec3::Unit(k);
      derivative.col(k) = (forward(x + offset) - forward(x - offset)) / (2 * kStep * frame().unit);
    }
    return derivative;
  }
};

TracedBallMap::TracedBallMap(BallMap table) {
  const GreenChart& chart = table.chart();
  const TriMesh& mesh = chart.green().shape().mesh();
  const double coreRadius = table.options().core == CoreMode::smooth ? table.options().coreRadius : 0;
  detail::CoreIsotopy isotopy(chart.directions(), table.sphere().directions, vertexAreas(mesh), coreRadius);
  data_ = std::make_shared<const Data>(Data{
      table, FieldLineTracer(chart.green(), kTraceTolerance), SphereLocator(mesh.vertices, mesh.triangles),
      detail::DirectionMap(chart.directions(), table.sphere().directions, mesh.triangles), isotopy});
}

void TracedBallMap::forward(std::span<const Vec3> solid, std::span<Vec3> domain) const {
  detail::parallelChunks(solid.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) domain[i] = data_->forward(data_->frame().toInner(solid[i]));
  });
}

void TracedBallMap::inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const {
  detail::parallelChunks(domain.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) solid[i] = data_->inverse(domain[i]);
  });
}

void TracedBallMap::jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const {
  detail::parallelChunks(solid.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      derivative[i] = data_->jacobian(data_->frame().toInner(solid[i]));
  });
}

}  // namespace polestar
