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
constexpr std::size_t kLinesInStep = 16;  // as many as the tracer takes together
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

  std::vector<Vec3> toInner(std::span<const Vec3> solid, std::size_t begin, std::size_t end) const {
    std::vector<Vec3> inner;
    for (std::size_t i = begin; i < end; ++i) inner.push_back(frame().toInner(solid[i]));
    return inner;
  }

  struct Value {
    Vec3 ball = kNowhere;  // none outside the solid, and where the trace failed
    double green = 0;
    bool inside = false;
  };

  // Of points in the inner frame. Their lines share the evaluations of the field.
  std::vector<Value> evaluate(std::span<const Vec3> x) const {
    std::vector<Value> values(x.size());
    std::vector<Vec3> starts;
    std::vector<std::size_t> ids;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!isInside(x[i])) continue;
      values[i].inside = true;
      if (x[i].isZero(0)) {
        values[i] = {Vec3::Zero(), std::numeric_limits<double>::infinity(), true};
        continue;
      }
      starts.push_back(x[i]);
      ids.push_back(i);
    }
    std::vector<double> green(starts.size());
    std::vector<Vec3> gradient(starts.size());
    chart().green().evaluate(starts, green, gradient);
    const std::vector<Vec3> ball = trace(starts, green);
    for (std::size_t k = 0; k < ids.size(); ++k) {
      values[ids[k]].green = green[k];
      values[ids[k]].ball = ball[k];
    }
    return values;
  }

  Vec3 forward(const Vec3& x) const { return evaluate({&x, 1}).front().ball; }

  bool isInside(const Vec3& x) const {
    if (!x.allFinite()) return false;
    if (x.isZero(0)) return true;
    const auto hit = surface.locate(x);
    return hit && x.norm() <= surface.point(*hit).norm() * (1 + 1e-12);
  }

  // Inward to two small levels, from there the limit by extrapolation. Points that lie outside of both go
  // there together.
  std::vector<Vec3> trace(const std::vector<Vec3>& starts, const std::vector<double>& green) const {
    constexpr std::array<double, 2> kLevels{0.06, 0.03};
    constexpr double kShare = 0.7;  // of the start's R, that the first level is at most
    std::vector<Vec3> ball(starts.size(), kNowhere), far;
    std::vector<std::size_t> farIds;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      const double share = kShare * chart().green().ballRadius(green[i]) / kLevels[0];
      if (share >= 1) {
        far.push_back(starts[i]);
        farIds.push_back(i);
        continue;
      }
      const std::array<double, 2> levels{share * kLevels[0], share * kLevels[1]};
      ball[i] = image(tracer.trace({&starts[i], 1}, levels).front(), levels, green[i]);
    }
    const std::vector<FieldLineTracer::Line> lines = tracer.trace(far, kLevels);
    for (std::size_t k = 0; k < far.size(); ++k) ball[farIds[k]] = image(lines[k], kLevels, green[farIds[k]]);
    return ball;
  }

  Vec3 image(const FieldLineTracer::Line& line, const std::array<double, 2>& levels, double green) const {
    if (!line.ok) return kNowhere;
    const Vec3 direction =
        limitDirection(line.nodes[0].position, levels[0], line.nodes[1].position, levels[1]);
    const std::optional<Vec3> phi = boundaryOf(direction);
    if (!phi) return kNowhere;
    const double radius = chart().green().ballRadius(green);
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
  detail::parallelChunks(solid.size(), kLinesInStep, [&](std::size_t begin, std::size_t end) {
    const std::vector<Data::Value> values = data_->evaluate(data_->toInner(solid, begin, end));
    for (std::size_t i = begin; i < end; ++i) domain[i] = values[i - begin].ball;
  });
}

std::size_t TracedBallMap::sample(std::span<const Vec3> solid, std::span<Vec3> domain,
                                  std::span<double> green) const {
  return detail::reduceChunks(
      solid.size(), kLinesInStep, std::size_t{0},
      [&](std::size_t begin, std::size_t end) {
        const std::vector<Data::Value> values = data_->evaluate(data_->toInner(solid, begin, end));
        std::size_t failed = 0;
        for (std::size_t i = begin; i < end; ++i) {
          const Data::Value& value = values[i - begin];
          if (value.ball.allFinite()) {
            domain[i] = value.ball;
            green[i] = std::max(0.0, value.green) / data_->frame().unit;
          } else {
            failed += value.inside;
            data_->table.sample(solid.subspan(i, 1), domain.subspan(i, 1), green.subspan(i, 1));
          }
        }
        return failed;
      },
      [](std::size_t a, std::size_t b) { return a + b; });
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
